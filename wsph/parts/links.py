"""Virtual links (Islam & Peng 2019, 3): a particle sees its immediate neighbours alone, and a link between two that meets
its criterion breaks for good.

A broken link has no weight any more: not in F and dF/dt, not in the correction, which is found anew, not in the pair force
(the paper's eqs 26-30 have f_ij in the force alone; so read, runs end in NaN, and with the correction left as it was a
rotating fragment loses a quarter of its angular momentum). Both ends find the same answer from the same numbers, so
forces stay antisymmetric while a body tears. A particle whose links span less than the space is free: no stress, F = I.

Stresses evolve by their rate: a pressure of F would create energy when F jumps with a broken link. On a lattice links to
the nearest neighbours are the rows and columns, and cracks follow them: turning the lattice turns a crack by up to 30
degrees (`wsph.parts.phase_field.field` has fracture that does not).

Criteria, n the current direction of the link:

    stretch           |x|/|X| - 1 >= threshold                                                        (eq 40)
    energy            the same with the stretch sqrt(2 G_c/(E spacing)): a row of links gives G_c per area
    plastic-strain    ln(|x|/|X|) - n.(C^-1 sigma).n >= threshold, sigma the mean of both ends: what of the link's strain its
                      stress does not explain (eqs 37-39)
    principal-stress  the largest principal stress of that mean >= threshold [Pa], on the links within 45 degrees of it
"""

from functools import cache
from typing import Any, Literal

import numpy as np
import warp as wp
from pydantic import model_validator

from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse, generalized_inverse, in_plane, principal
from wsph.constitutive.elastic import elastic_strain
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.errors import Refused
from wsph.plugins.traits import turns
from wsph.protocols import BodyKeys
from wsph.quantities import Model, in_unit
from wsph.sph.misfit import misfit
from wsph.sph.pairs import Pairs
from wsph.units import quantity


class Links(Model):
    """Virtual links that break: by `criterion`, at `threshold` (a strain, or Pa for principal-stress) or, for
    "energy", at the `fracture_energy` [J/m2]; only between particles that `where` selects, if it is given."""

    criterion: Literal["stretch", "energy", "plastic-strain", "principal-stress"]
    threshold: float | str | None = None
    fracture_energy: in_unit("J/m2", gt=0) | None = None
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


SUPPORT = 1.3
"""Support of bodies with links, in spacings: the nearest neighbours on a square lattice, as the paper's h = .65 spacings."""

CRUSHED = 0.05
"""The volume, of the one at the start, below which a particle loses its links."""


@cache
def _kernels(space: Space, laws: Laws, layout: Layout, criterion: str) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    Params, energy, (unpack, _), axes_of = laws.Params, laws.energy, packing(space, laws.state), principal(space)
    inverse, determinant = generalized_inverse(space), determinant_and_inverse(space)[0]
    stretched, stress = criterion in ("stretch", "energy"), laws.stress
    plane, strain_of, left_over = in_plane(space), elastic_strain(space, Params), misfit(space)

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

    @wp.func
    def gradient(i: int, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                 node: wp.array(dtype=vec), u: wp.array(dtype=vec), moment: mat) -> mat:  # fmt: skip
        total = mat()
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            total += weight[k] * wp.outer(u[j] - u[i], node[j] - node[i])
        return total * moment

    @wp.kernel(module="unique", enable_backward=False)
    def tear(first: int, p: Params, threshold: real, stiffness: real, breakable: wp.array(dtype=wp.int32), offsets: wp.array(dtype=wp.int32),
             indices: wp.array(dtype=wp.int32), node: wp.array(dtype=vec), share: wp.array(dtype=real), moment: wp.array(dtype=mat),
             fields: Fields, weight_out: wp.array(dtype=real), torn_out: wp.array(dtype=wp.int32), released_out: wp.array(dtype=real)):  # fmt: skip
        i = first + wp.tid()
        one = wp.identity(n=dim, dtype=real)
        crushed = determinant(one + fields.deformation[i]) < real(CRUSHED)
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            if weight_out[k] > real(0.0) and breakable[i] * breakable[j] == 1:
                r = node[j] - node[i]
                apart = r + (fields.displacement[j] - fields.displacement[i])
                mean = real(0.5) * (fields.stress[i] + fields.stress[j])
                gone = crushed or determinant(one + fields.deformation[j]) < real(CRUSHED)
                if gone or has_broken(p, threshold, r, apart, mean):
                    if torn_out[i] == 0:
                        u = fields.displacement
                        H = gradient(i, offsets, indices, weight_out, node, u, moment[i])
                        square = left_over(i, u[i], node[i], H, offsets, indices, weight_out, node, u)
                        released_out[i] = released_out[i] + real(0.5) * stiffness * share[i] * square
                        torn_out[i] = 1
                    weight_out[k] = real(0.0)

    # What neighbours ask of each other has been read: now stresses and deformations may change.
    @wp.kernel(module="unique", enable_backward=False)
    def settle(first: int, p: Params, stiffness: real, volume: wp.array(dtype=real), offsets: wp.array(dtype=wp.int32),
               indices: wp.array(dtype=wp.int32), node: wp.array(dtype=vec), weight: wp.array(dtype=real), fields: Fields,
               torn_out: wp.array(dtype=wp.int32), share_out: wp.array(dtype=real), moment_out: wp.array(dtype=mat),
               released_out: wp.array(dtype=real)):  # fmt: skip
        i = first + wp.tid()
        if torn_out[i] == 1:
            torn_out[i] = 0
            left = int(0)
            moment = mat()
            for k in range(offsets[i], offsets[i + 1]):
                if weight[k] > real(0.0):
                    r = node[indices[k]] - node[i]
                    left += 1
                    moment += weight[k] * wp.outer(r, r)
            b, rank = inverse(moment, real(0.0))
            one = wp.identity(n=dim, dtype=real)
            stored = volume[i] * energy(p, fields.stress[i])
            released = stored * determinant(one + fields.deformation[i])
            if rank < wp.static(dim):
                # Free: nothing says what a linear field leaves.
                b = mat()
                share_out[i] = real(0.0)
                fields.stress[i] = stress()
                fields.deformation[i] = mat()
            else:
                u = fields.displacement
                H = gradient(i, offsets, indices, weight, node, u, b)
                square = left_over(i, u[i], node[i], H, offsets, indices, weight, node, u)
                released -= stored * determinant(one + H) + real(0.5) * stiffness * share_out[i] * square
                fields.deformation[i] = H
            moment_out[i] = b
            released_out[i] = released_out[i] + released
            fields.damage[i][0] = real(1.0) - real(left) / real(offsets[i + 1] - offsets[i])

    return tear, settle


class LinkDamage:
    """The links of a body: `advance` breaks those that meet the criterion and frees what they leave behind."""

    def __init__(self, part: Links, space: Space, laws: Laws, params: Any, state: State, pairs: Pairs,
                 weight: wp.array, moment: wp.array, share: wp.array, node: wp.array, volume: np.ndarray, breakable: np.ndarray,
                 threshold: float, stiffness: float, device: str):  # fmt: skip
        """`threshold` and `stiffness` (of the residual) nondimensional, `breakable` (n,) bool."""
        self._share, self._stiffness = share, space.scalar(stiffness)
        self.part, self._state, self._params = part, state, params
        self._threshold, self._pairs, self._weight, self._moment, self._node = threshold, pairs, weight, moment, node
        self._space, self._kernels = space, _kernels(space, laws, state.layout, part.criterion)
        self._breakable = wp.array(breakable.astype(np.int32), dtype=wp.int32, device=device)
        self._volume = wp.array(volume, dtype=space.scalar, device=device)
        self._torn = wp.zeros(len(volume), dtype=wp.int32, device=device)
        self._released = wp.zeros(len(volume), dtype=space.scalar, device=device)
        self._whole = [(array, array.numpy().copy()) for array in (weight, moment, share)]

    def advance(self, clock: Any) -> None:
        """Close a step (two launches)."""
        tear, settle = self._kernels
        rows = [self._pairs.offsets, self._pairs.indices, self._node]
        inputs = [self._params, self._space.scalar(self._threshold), self._stiffness, self._breakable, *rows]
        inputs += [self._share, self._moment, self._state.struct]
        clock.launch(tear, self._state.n, inputs, [self._weight, self._torn, self._released])
        inputs = [self._params, self._stiffness, self._volume, *rows, self._weight, self._state.struct]
        clock.launch(settle, self._state.n, inputs, [self._torn, self._share, self._moment, self._released])

    def clear(self) -> None:
        """Whole again."""
        for array, values in self._whole:
            array.assign(values)
        for array in (self._torn, self._released, self._state.struct.damage):
            array.zero_()

    def kept(self) -> dict[str, wp.array]:
        """What a checkpoint holds of it."""
        names = ("weight", "moment", "share", "released")
        arrays = (self._weight, self._moment, self._share, self._released)
        return {**dict(zip(names, arrays, strict=True)), "damage": self._state.struct.damage}

    @property
    def released(self) -> float:
        """Energy of the particles that have come free, and of the residual that broken links have no more,
        nondimensional."""
        return float(self._released.numpy().sum(dtype=float))

    def found(self) -> dict[str, float]:
        """Broken links and free particles."""
        return {
            "broken_links": int((self._weight.numpy() == 0.0).sum()) // 2,
            "free": int((self._moment.numpy().reshape(self._state.n, -1) == 0.0).all(1).sum()),
        }

    @property
    def nbytes(self) -> int:
        """Device memory beside the pairs' own [bytes]."""
        return sum(a.capacity for a in (self._breakable, self._volume, self._torn, self._released))


def stretch_of_energy(fracture_energy: float, youngs: float, spacing: float) -> float:
    """The stretch at which a row of links has taken G_c per area: E s^2 spacing/2 = G_c."""
    return float(np.sqrt(2.0 * fracture_energy / (youngs * spacing)))


def refuse(body: BodyKeys, material: Any, who: str, correction: str) -> None:
    """Refuse what links cannot do."""
    if body.phase_field is not None:
        raise Refused(f"body {body.name!r}: it breaks by links or by phase_field, not by both: leave one out")
    if correction == "paper":
        raise Refused(
            f'body {body.name!r}: links need the symmetric correction: run.correction = "paper" keeps no momentum at a crack'
        )
    if body.viscosity is not None and body.viscosity.correction == "paper":
        raise Refused(
            f'body {body.name!r}: links need symmetric viscosity: viscosity.correction = "paper" keeps no momentum at a crack; leave'
            " it out"
        )
    if not turns(material):
        raise Refused(
            f"body {body.name!r}: links need a rate law that turns with the body, whose stress does not jump where F does;"
            f" {who} is not one: use jaumann, mises or perzyna"
        )
