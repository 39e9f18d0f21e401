"""A material in a stress state, ready for kernels: its parameters, nondimensional, and its laws."""

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.constitutive.evolution import volume_ratio
from wsph.constitutive.kept import STORED, THINNING
from wsph.constitutive.laws import Laws, laws_of, parameters
from wsph.constitutive.stress_state import StressState
from wsph.errors import Refused
from wsph.plugins.blame import RATE_SIGNATURE, blame
from wsph.plugins.traits import flows, gives, internal_units, internal_values, own_internals
from wsph.protocols import Material
from wsph.units import Scales


def _refuse_what_is_not_applied(material: Material, who: str) -> None:
    """Refuse members of a law that no formulation applies: they would be dropped silently."""
    if gives(material, "objective"):
        raise Refused(f"{who} declares 'objective', which is not applied yet; give its whole law as `rate`")
    if gives(material, "project") and not gives(material, "rate"):
        raise Refused(f"{who} has `project` without `rate`: what is brought back is the stress that a rate gave")
    if not (gives(material, "rate") or gives(material, "stress")):
        raise Refused(f"{who} has neither `rate` nor `stress`; every formulation needs one of them: {RATE_SIGNATURE}")
    if (names := flows(material)) and not (names[0] in own_internals(material) and hasattr(material, names[1])):
        raise Refused(f"{who} has flows = {names!r}: an internal, the plastic strain, and a field, the yield stress")
    reserved = {
        THINNING,
        STORED,
        "velocity",
        "stress",
        "displacement",
        "density",
        "von_mises",
        "pressure",
        "dissipation",
        "damage",
        "id",
        "body",
    }
    taken = reserved.intersection(own_internals(material))
    if taken:
        raise Refused(f"{who} names an internal {sorted(taken)[0]!r}, which is a field of every body")


def _largest_modulus(dim: int, wave: float, shear: float) -> float:
    """The largest stiffness of an isotropic material at rest, of the same deformation along all axes or of shear, from the
    moduli of its longitudinal and its shear waves."""
    return max(dim * wave - 2.0 * (dim - 1) * shear, 2.0 * shear if dim > 1 else 0.0)


class Constitutive:
    """A material in a stress state, ready for kernels.

    `params` (struct of inner, nondimensional numbers), `density`, `largest_modulus` (against any deformation of size one),
    `internals` (name -> initial value, the dissipation included where the law relaxes, and what else is kept of a body that
    moves), and the Warp functions of `laws`.
    """

    def __init__(
        self,
        space: Space,
        material: Material,
        state: StressState,
        scales: Scales,
        who: str,
        *,
        evolves: bool = False,
    ):
        """`evolves`: its stress follows from its rate law in a body whose deformation is followed. It turns with the body,
        free normals thin it, and the energy that it stores is counted as it flows in."""
        self.space, self.material, self.state, self.who = space, material, state, who
        bulk, shear = material.moduli()
        self.wave_speed = state.wave_speed(bulk, shear, material.density)
        self.internal_scales = {name: scales.of(unit) for name, unit in internal_units(material).items()}
        values = {name: value / self.internal_scales[name] for name, value in internal_values(material).items()}
        _refuse_what_is_not_applied(material, who)
        with blame(who):
            self.laws = laws_of(space, material, state, evolves)
        own = {name: value for name, value in values.items() if name in own_internals(material)}
        # The dissipation is the last.
        self.internals: dict[str, float] = {**own, **dict.fromkeys(self.laws.kept.hidden, 0.0), **values}
        self.params = self.laws.Params()
        for name, unit in parameters(material).items():
            value = {"elastic_bulk": bulk, "elastic_shear": shear}.get(name)
            value = getattr(material, name) if value is None else value
            setattr(self.params, name, space.scalar(value / scales.of(unit)))
        self.density = material.density / scales.density
        wave = self.density * (self.wave_speed / scales.velocity) ** 2
        self.largest_modulus = _largest_modulus(space.dim, wave, shear / scales.of("Pa"))

    @property
    def youngs_modulus(self) -> float:
        """[Pa]"""
        bulk, shear = self.material.moduli()
        return 9.0 * bulk * shear / (3.0 * bulk + shear)

    @property
    def flow(self) -> tuple[int, float] | None:
        """Which of the internals is the plastic strain, and E over the yield stress; None where the material has none."""
        names = flows(self.material)
        if names is None:
            return None
        internal, stress = names
        return list(self.internals).index(internal), self.youngs_modulus / getattr(self.material, stress)

    @property
    def width(self) -> int:
        """Number of stress components kept."""
        return len(self.state.components)


def counted(space: Space, laws: Laws, layout: Layout) -> wp.Function:
    """Warp function (p, fields, i, stress before and after a return, internals before and after) -> the internals, with what
    was dissipated and what is stored per volume at the start."""
    Params, energy, stored, last = laws.Params, laws.energy, laws.kept.stored, laws.kept.dissipation
    stress, internal = laws.stress, laws.internal
    Fields, ratio = fields_struct(space, layout), volume_ratio(space, laws, layout)

    @wp.func
    def of_start(p: Params, fields: Fields, i: int, before: stress, after: stress, old: internal, q: internal):
        if wp.static("deformation" in layout):
            J = ratio(fields, i)
            q[last] = old[last] + J * (q[last] - old[last])
            if wp.static(stored >= 0):
                q[stored] = q[stored] + J * (energy(p, after) - energy(p, before))
        return q

    return of_start


@cache
def project_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    """Bring the stresses of a state back, over its points."""
    Params, project, fields = laws.Params, laws.project or laws.respond, fields_struct(space, layout)
    of_start = counted(space, laws, layout)

    # Without loops, but twice in every step: in all that this processor has.
    @kernel(ranged=True, lanes=True)
    def bring_back(first: int, p: Params, fields_out: fields):
        i = first + wp.tid()
        before = fields_out.stress[i]
        old = fields_out.internals[i]
        stress, q = project(p, before, old)
        # Most points of most bodies stay within what the law allows: of them nothing else is read, and nothing written.
        if not (stress == before and q == old):
            fields_out.stress[i] = stress
            fields_out.internals[i] = of_start(p, fields_out, i, before, stress, old, q)

    return bring_back


@cache
def project_faces_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    """Bring the stresses of a state back, over its particles. Where bits of `free` are set the stress is in the axes of the
    particle's face, and these normals keep theirs."""
    Params, project, fields = laws.Params, laws.project or laws.respond, fields_struct(space, layout)
    at_face, of_start, internal = laws.project_face or laws.respond, counted(space, laws, layout), laws.internal
    packed = laws.stress

    @kernel(ranged=True)
    def bring_back(first: int, p: Params, free: wp.array(dtype=wp.int32), fields_out: fields):
        i = first + wp.tid()
        before = fields_out.stress[i]
        old = fields_out.internals[i]
        stress = packed()
        q = internal()
        if free[i] == 0:
            stress, q = project(p, before, old)
        else:
            stress, q = at_face(p, before, old, free[i])
        fields_out.stress[i] = stress
        fields_out.internals[i] = of_start(p, fields_out, i, before, stress, old, q)

    return bring_back
