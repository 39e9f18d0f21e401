"""Virtual links (Islam & Peng 2019, 3): a particle sees its immediate neighbours alone, and a link between two that meets
its criterion breaks for good.

A broken link has no weight any more: not in F and dF/dt, not in the correction, which is recomputed, not in the pair force
(the paper's eqs 26-30 have f_ij in the force alone; so read, runs end in NaN, and with the correction left as it was a
rotating fragment loses a quarter of its angular momentum). Both ends find the same answer from the same numbers, so
forces stay antisymmetric while a body tears. A particle whose links span less than the space is free: no stress, F = I.

Stresses evolve by their rate: a pressure of F would create energy when F jumps with a broken link. On a lattice links to
the nearest neighbours are the rows and columns, and cracks follow them: turning the lattice turns a crack by up to 30
degrees (`wsph.parts.phase_field` has fracture that does not).

Criteria, n the current direction of the link:

    stretch           |x|/|X| - 1 >= threshold                                                        (eq 40)
    energy            the same with the stretch sqrt(2 G_c/(E spacing)): a row of links gives G_c per area
    plastic-strain    ln(|x|/|X|) - n.(C^-1 sigma).n >= threshold, sigma the mean of both ends: the part of the link's
                      strain that its stress does not explain (eqs 37-39)
    principal-stress  the largest principal stress of that mean >= threshold [Pa], on the links within 45 degrees of it
"""

from functools import cache, partial
from typing import Annotated, ClassVar, Literal

import numpy as np
import warp as wp
from pydantic import model_validator

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import any_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse, generalized_inverse, in_plane, principal
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.elastic import elastic_strain
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.declarations import example
from wsph.errors import Refused
from wsph.geometry.selection import ranges, select
from wsph.parts.part import Attached, Host, Neighbourhood, Part
from wsph.parts.terms import points_struct
from wsph.parts.viscosity import Viscosity
from wsph.plugins.traits import turns
from wsph.protocols import Entry, Traits
from wsph.quantities import Unit
from wsph.ranks.blocks import own_sum
from wsph.ranks.kept import Rows
from wsph.sph.misfit import misfit
from wsph.sph.rows import rows_of, rows_struct
from wsph.units import quantity

CRUSHED = 0.05
"""The volume, of the one at the start, below which a particle loses its links."""


class Links(Part):
    """Virtual links that break: by `criterion`, at `threshold` (a strain, or Pa for principal-stress) or, for
    "energy", at the `fracture_energy` [J/m2]; only between particles that `where` selects, if it is given."""

    model_config = example({"criterion": "energy", "fracture_energy": "100 J/m2"})
    key: ClassVar[str] = "links"
    formal: ClassVar[int] = 1
    breaks: ClassVar[bool] = True
    offers: ClassVar[tuple[str, ...]] = ("damage",)
    frees: ClassVar[bool] = True
    # The nearest neighbours on a square lattice, as the paper's h = 0.65 spacings.
    support: ClassVar[float | None] = 1.3
    criterion: Literal["stretch", "energy", "plastic-strain", "principal-stress"]
    threshold: float | str | None = None
    fracture_energy: Annotated[float, Unit("J/m2", gt=0)] | None = None
    where: str | None = None

    @model_validator(mode="after")
    def _one_measure(self) -> "Links":
        wanted = "fracture_energy" if self.criterion == "energy" else "threshold"
        given = [name for name in ("threshold", "fracture_energy") if getattr(self, name) is not None]
        if given != [wanted]:
            raise ValueError(
                f"criterion {self.criterion!r} needs {wanted} and nothing else: given {given or 'neither'}"
            )
        if self.threshold is not None and self.limit <= 0.0:
            raise ValueError(f"threshold = {self.threshold!r} is not above zero")
        return self

    @property
    def limit(self) -> float:
        """The threshold: a strain, or Pa."""
        return quantity(self.threshold, "Pa" if self.criterion == "principal-stress" else "")

    @property
    def selections(self) -> dict[str, str]:
        return {"where": self.where} if self.where is not None else {}

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        return traits.pairwise and traits.reference

    def refuse(self, host: Host) -> None:
        viscosity = host.parts.get("viscosity")
        if "phase_field" in host.parts:
            raise Refused(f"body {host.name!r}: it breaks by links or by phase_field, not by both: leave one out")
        if host.correction == "paper":
            raise Refused(
                f'body {host.name!r}: links need the symmetric correction: run.correction = "paper" keeps no momentum at a crack'
            )
        if isinstance(viscosity, Viscosity) and viscosity.correction == "paper":
            raise Refused(
                f'body {host.name!r}: links need symmetric viscosity: viscosity.correction = "paper" keeps no momentum at a crack;'
                " leave it out"
            )
        if not turns(host.constitutive.material):
            raise Refused(
                f"body {host.name!r}: links need a rate law that turns with the body, whose stress does not jump where F does;"
                f" {host.constitutive.who} is not one: use jaumann, mises or perzyna"
            )

    def warning(self, host: Host) -> str:
        return f"body {host.name!r}: cracks of links follow the lattice, by up to 30 degrees; phase_field has fracture that does not"

    def fields(self, host: Host) -> tuple[Field, ...]:
        return (Field("damage", 1, "", at_points=True, derived=True, bounded=True),)

    def attach(self, host: Host, seen: Neighbourhood, state: State, clock: Clock, arrays: Arrays) -> Attached | None:
        spacing = host.geometry.spacing
        may = np.ones(len(seen.position), bool) if self.where is None else select(self.where, seen.position, spacing)
        if not any_of(seen.split.domain, bool(may.any())):
            raise Refused(
                f"body {host.name!r}: links.where: {self.where!r} selects no particle: they have {ranges(self.where, seen.position)}"
            )
        if self.fracture_energy is not None:
            threshold = stretch_of_energy(self.fracture_energy, host.youngs_modulus, spacing)
        else:
            threshold = self.limit / (host.scales.stress if self.criterion == "principal-stress" else 1.0)
        face = (spacing / host.scales.length) ** (host.space.dim - 1)
        return LinkDamage(self.criterion, threshold, face, host.constitutive, seen, may, state, clock, arrays)


def stretch_of_energy(fracture_energy: float, youngs: float, spacing: float) -> float:
    """The stretch at which a row of links has taken G_c per area: E s^2 spacing/2 = G_c."""
    return float(np.sqrt(2.0 * fracture_energy / (youngs * spacing)))


@cache
def _broken(space: Space, laws: Laws, criterion: str) -> wp.Function:
    """Warp function (p, threshold, r, current r, mean stress) -> whether a link meets its criterion."""
    real, vec, dim, stress, Params = space.scalar, space.vec, space.dim, laws.stress, laws.Params
    (unpack, _), axes_of, plane = packing(space, laws.state), principal(space), in_plane(space)
    strain_of, stretched = elastic_strain(space, Params), criterion in ("stretch", "energy")

    @wp.func
    def has_broken(p: Params, threshold: real, r: vec, apart: vec, mean: stress) -> bool:
        ratio = wp.length(apart) / wp.length(r)
        if wp.static(stretched):
            return ratio - real(1.0) >= threshold
        n = wp.normalize(apart)
        if wp.static(criterion == "plastic-strain"):
            return wp.log(ratio) - wp.dot(n, plane(strain_of(p, unpack(mean))) * n) >= threshold
        axes, values = axes_of(plane(unpack(mean)))
        most = int(0)
        for a in range(wp.static(dim)):
            if values[a] > values[most]:
                most = a
        cosine = real(0.0)
        for a in range(wp.static(dim)):
            cosine += axes[a, most] * n[a]
        return values[most] >= threshold and cosine * cosine >= real(0.5)

    return has_broken


@cache
def _gradient(space: Space) -> wp.Function:
    """Warp function (i, rows, node, displacement, moment) -> displacement gradient."""
    vec, mat, Rows = space.vec, space.mat, rows_struct(space)

    @wp.func
    def gradient(i: int, rows: Rows, node: wp.array(dtype=vec), u: wp.array(dtype=vec), moment: mat) -> mat:
        total = mat()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            j = rows.indices[k]
            total += rows.weight[k] * wp.outer(u[j] - u[i], node[j] - node[i])
        return total * moment

    return gradient


@cache
def _tear_kernel(space: Space, laws: Laws, layout: Layout, criterion: str) -> wp.Kernel:
    """Take the weight from the links that meet the criterion; the energy that the residual held there is counted."""
    real, dim, Fields, Params = space.scalar, space.dim, fields_struct(space, layout), laws.Params
    Rows, Points = rows_struct(space), points_struct(space)
    has_broken, gradient, left_over = _broken(space, laws, criterion), _gradient(space), misfit(space)
    determinant = determinant_and_inverse(space)[0]

    @kernel(ranged=True)
    def tear(
        first: int,
        p: Params,
        threshold: real,
        breakable: wp.array(dtype=wp.int32),
        points: Points,
        fields: Fields,
        rows_out: Rows,
        torn_out: wp.array(dtype=wp.int32),
        released_out: wp.array(dtype=real),
    ):
        i = first + wp.tid()
        one = wp.identity(n=dim, dtype=real)
        crushed = determinant(one + fields.deformation[i]) < real(CRUSHED)
        for k in range(rows_out.offsets[i], rows_out.offsets[i + 1]):
            j = rows_out.indices[k]
            if rows_out.weight[k] > real(0.0) and breakable[i] * breakable[j] == 1:
                r = points.node[j] - points.node[i]
                apart = r + (fields.displacement[j] - fields.displacement[i])
                mean = real(0.5) * (fields.stress[i] + fields.stress[j])
                gone = crushed or determinant(one + fields.deformation[j]) < real(CRUSHED)
                if gone or has_broken(p, threshold, r, apart, mean):
                    if torn_out[i] == 0:
                        u = fields.displacement
                        H = gradient(i, rows_out, points.node, u, points.moment[i])
                        square = left_over(i, u[i], points.node[i], H, rows_out, points.node, u)
                        released_out[i] = released_out[i] + real(0.5) * points.stabilisation * points.share[i] * square
                        torn_out[i] = 1
                    rows_out.weight[k] = real(0.0)

    return tear


@cache
def _settle_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    """Moments, stresses and deformations of the particles whose links have broken, once all neighbours have been read."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    stress, stored, Rows, Points = laws.stress, laws.kept.stored, rows_struct(space), points_struct(space)
    inverse = generalized_inverse(space)
    gradient, left_over = _gradient(space), misfit(space)

    @kernel(ranged=True)
    def settle(
        first: int,
        rows: Rows,
        points_out: Points,
        fields_out: Fields,
        torn_out: wp.array(dtype=wp.int32),
        released_out: wp.array(dtype=real),
    ):
        i = first + wp.tid()
        if torn_out[i] == 1:
            torn_out[i] = 0
            left = int(0)
            moment = mat()
            for k in range(rows.offsets[i], rows.offsets[i + 1]):
                if rows.weight[k] > real(0.0):
                    r = points_out.node[rows.indices[k]] - points_out.node[i]
                    left += 1
                    moment += rows.weight[k] * wp.outer(r, r)
            b, rank = inverse(moment, real(0.0))
            released = points_out.volume[i] * fields_out.internals[i][stored]
            if rank < wp.static(dim):
                # Free: nothing says what a linear field leaves.
                b = mat()
                points_out.share[i] = real(0.0)
                fields_out.stress[i] = stress()
                fields_out.internals[i][stored] = real(0.0)
                fields_out.deformation[i] = mat()
            else:
                u = fields_out.displacement
                H = gradient(i, rows, points_out.node, u, b)
                square = left_over(i, u[i], points_out.node[i], H, rows, points_out.node, u)
                # What is stored is per volume at the start: another deformation does not change it.
                released = real(-0.5) * points_out.stabilisation * points_out.share[i] * square
                fields_out.deformation[i] = H
            points_out.moment[i] = b
            released_out[i] = released_out[i] + released
            fields_out.damage[i][0] = real(1.0) - real(left) / real(rows.offsets[i + 1] - rows.offsets[i])

    return settle


class LinkDamage(Attached):
    """The links of a body: `advance` breaks those that meet the criterion and frees particles that are left with too
    few. It writes the weights of the pairs, and the moments and shares of the points."""

    def __init__(
        self,
        criterion: str,
        threshold: float,
        face: float,
        constitutive: Constitutive,
        seen: Neighbourhood,
        breakable: np.ndarray,
        state: State,
        clock: Clock,
        arrays: Arrays,
    ):
        """`threshold` and the area of a `face` of a cell nondimensional, `breakable` (n,) bool: particles whose links can
        break. Of n particles the device has

        _breakable  # (n,) int32, 1 or 0
        _torn       # (n,) int32, 1 where a link broke in this step: moments and stress have to follow
        _released   # (n,) scalar, energy set free so far, nondimensional
        """
        space, laws, n = constitutive.space, constitutive.laws, len(breakable)
        self._space, self._seen, self._state, self._clock = space, seen, state, clock
        self._params, self._threshold, self._face = constitutive.params, space.scalar(threshold), face
        self._tear = _tear_kernel(space, laws, state.layout, criterion)
        self._settle = _settle_kernel(space, laws, state.layout)
        self._rows = rows_of(space, seen.pairs, seen.weight)
        self._breakable = arrays.of("breakable", breakable.astype(np.int32), wp.int32)
        self._torn = arrays.zeros("torn", n, wp.int32)
        self._released = arrays.zeros("released", n, space.scalar, kept=True)
        for name, array in (("weight", seen.weight), ("moment", seen.points.moment), ("share", seen.points.share)):
            arrays.changes(name, array)
        damage = state.struct.damage
        arrays.take("damage", damage, kept=True, reset=damage.zero_)
        self.weight, self.damage, split = seen.weight, damage, seen.split
        self._domain, self._share = split.domain, split.particles
        self._halo = split.domain.halo(split.particles)
        self.ledger = (Entry("dissipated", lambda: self.released),)

    def advance(self) -> None:
        """Close a step (two launches). Whether a link breaks both ends find from the same numbers: copies have those of the
        particles that other processes own."""
        if self._domain.size > 1:
            for name in (name for name in ("stress", "deformation", "internals") if name in self._state.widths):
                self._clock.host(partial(self._halo.update, getattr(self._state.struct, name)))
        n, points, fields = self._state.n, self._seen.points, self._state.struct
        inputs = [self._params, self._threshold, self._breakable, points, fields]
        self._clock.launch(self._tear, n, inputs, [self._rows, self._torn, self._released])
        outputs = [points, fields, self._torn, self._released]
        self._clock.launch(self._settle, n, [self._rows], outputs)

    @property
    def released(self) -> float:
        """Energy of the particles that have come free, and of the residual that broken links have no more,
        nondimensional."""
        return own_sum(self._released.numpy(), self._share, self._domain)

    def rows(self) -> dict[str, Rows]:
        _, particles = self._seen.split.rows()
        ends = self._seen.pairs.rows(), self._seen.pairs.indices.numpy()
        own = self._share.owns(ends[0])
        first, second = (each.astype(np.int64) + self._share.first for each in ends)
        pairs = Rows.by_keys((first * self._share.whole + second)[:, None], own, self._domain)
        return {"weight": pairs, **dict.fromkeys(("moment", "share", "released", "damage"), particles)}

    def fracture(self) -> dict[str, float]:
        """Broken links, the area of as many faces of a cell, free particles, and the energy that they set free."""
        moment = self._seen.points.moment.numpy().reshape(self._state.n, -1)[self._share.own]
        of_own = slice(*self._seen.pairs.offsets.numpy()[[self._share.own.start, self._share.own.stop]])
        broken = (self._seen.weight.numpy()[of_own] == 0.0).sum(), (moment == 0.0).all(1).sum()
        links, free = self._domain.sum(np.array(broken)).tolist()
        return {
            "broken_links": links // 2,
            "crack_area": links // 2 * self._face,
            "free": free,
            "released_energy": self.released,
        }
