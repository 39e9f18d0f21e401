"""What the kernels of two surfaces that meet take: numbers of the law, candidates, memory of the contact, what acts."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.space import Space

SHARED = 8
"""Faces, equally near to a vertex, that share its contact."""

FAR = 1e30
"""The gap of a vertex that has nothing to meet."""

Faces = wp.types.vector(length=SHARED, dtype=wp.int32)


def _struct(name: str, annotations: dict[str, object]) -> type:
    return wp.struct(type(name, (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def law_struct(space: Space) -> type:
    """Numbers of the law of one surface's vertices against another's faces, all scalars, nondimensional.

    stiffness  # pressure per depth
    impedance  # of the damper, pressure per speed
    softening  # rate: the impedance is divided by 1 + softening dt
    friction   # Coulomb's coefficient mu
    tangent    # stiffness of stick over that of depth
    relax      # 1/tau of friction's memory, 0 for none
    depth      # from a face, at which a vertex does not meet it any more
    width      # spacing of the vertices' surface
    span       # a bound of the faces' diameters
    edges      # 1 where edges meet edges too, else 0
    """
    names = (
        "stiffness",
        "impedance",
        "softening",
        "friction",
        "tangent",
        "relax",
        "depth",
        "width",
        "span",
        "edges",
    )
    return _struct("MeetingLaw", dict.fromkeys(names, space.scalar))


@cache
def candidates_struct() -> type:
    """Struct of candidates, of those k that have any.

    which    # who they are, (k,) int32
    offsets  # (k + 1,) int32, where the candidates of each begin in
    indices  # int32
    """
    return _struct("Candidates", dict.fromkeys(("which", "offsets", "indices"), wp.array(dtype=wp.int32)))


def memory(space: Space) -> dict[str, type]:
    """The types of what contacts remember, by name."""
    real, vec, double = space.scalar, space.vec, wp.float64
    return {
        "gap": real,
        "ease": real,
        "account": double,
        "elastic": vec,
        "damper": vec,
        "stick": vec,
        "pressing": real,
        "touching": real,
        "parted": real,
        "stored": double,
        "sprung": double,
        "lost": double,
    }


@cache
def memory_struct(space: Space) -> type:
    """Struct of what contacts remember of the last step, nondimensional.

    gap       # to what may be met, FAR where there is nothing
    ease      # gap that counts as none, <= 0: bodies that overlap at the start begin without force
    account   # work that the bodies have put into the elastic forces and have not got back
    elastic   # elastic normal force
    damper    # force that gives no energy back
    stick     # way of sliding that friction's spring holds
    pressing  # mean of the normal force, that friction follows
    touching  # time in contact
    parted    # time since
    stored    # energy of the elastic normal forces
    sprung    # energy of friction's spring
    lost      # energy that friction and damping have taken so far
    """
    return _struct("Memory", {name: wp.array(dtype=dtype) for name, dtype in memory(space).items()})


@cache
def held_struct(space: Space) -> type:
    """The memory of one contact."""
    return _struct("Held", dict(memory(space)))


@cache
def reading(space: Space) -> wp.Function:
    """Warp function (memory, index) -> that of one contact."""
    Memory, Held = memory_struct(space), held_struct(space)

    @wp.func
    def held(m: Memory, i: int) -> Held:
        h = Held()
        h.gap = m.gap[i]
        h.ease = m.ease[i]
        h.account = m.account[i]
        h.elastic = m.elastic[i]
        h.damper = m.damper[i]
        h.stick = m.stick[i]
        h.pressing = m.pressing[i]
        h.touching = m.touching[i]
        h.parted = m.parted[i]
        h.stored = m.stored[i]
        h.sprung = m.sprung[i]
        h.lost = m.lost[i]
        return h

    return held


@cache
def writing(space: Space) -> wp.Function:
    """Warp function (memory, index, that of one contact): writes it."""
    Memory, Held = memory_struct(space), held_struct(space)

    @wp.func
    def hold(m: Memory, i: int, h: Held):
        m.gap[i] = h.gap
        m.ease[i] = h.ease
        m.account[i] = h.account
        m.elastic[i] = h.elastic
        m.damper[i] = h.damper
        m.stick[i] = h.stick
        m.pressing[i] = h.pressing
        m.touching[i] = h.touching
        m.parted[i] = h.parted
        m.stored[i] = h.stored
        m.sprung[i] = h.sprung
        m.lost[i] = h.lost

    return hold


@cache
def record_struct(space: Space) -> type:
    """Struct of what acts on n vertices, of one evaluation.

    force  # on each, (n,) vec
    count  # faces that it acts on the other way, 0 where nothing acts, (n,) int32
    faces  # those, (n,) Faces
    """
    return _struct(
        "Record",
        {"force": wp.array(dtype=space.vec), "count": wp.array(dtype=wp.int32), "faces": wp.array(dtype=Faces)},
    )
