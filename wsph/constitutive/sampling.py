"""A material's bare laws over arrays, by themselves: for the kits that check plugins, and to find whose fault a NaN
is."""

from collections.abc import Generator
from contextlib import contextmanager
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.free_normals import PROJECT_SIGNATURE, TOTAL_SIGNATURE
from wsph.constitutive.laws import user_law
from wsph.constitutive.stress_state import STRESS_STATES
from wsph.errors import PluginError, WsphError, is_out_of_memory
from wsph.plugins.blame import blame
from wsph.plugins.traits import gives, own_internals
from wsph.protocols import Material
from wsph.units import Scales

_TRIED = 200
"""Samples by which a law is tried."""


class LawSampler:
    """A material's bare laws over arrays, nondimensional: stress over rho c^2, rates over c per metre. Raises
    PluginError where a law does not compile."""

    def __init__(self, material: Material, precision: str = "f64", who: str = ""):
        """`who` is what messages call the material."""
        self.space, self.material, self.who = Space(3, precision), material, who or type(material).__name__
        bulk, shear = material.moduli()
        state = STRESS_STATES[3, None]
        speed = state.wave_speed(bulk, shear, material.density)
        self.scales = Scales(1.0, 1.0 / speed, material.density)
        self.constitutive = Constitutive(self.space, material, state, self.scales, self.who)
        self.names = list(own_internals(material))
        self.initial = np.array([self.constitutive.internals[name] for name in self.names])
        self.bulk, self.shear = bulk / self.scales.stress, shear / self.scales.stress

    def __call__(self, stress: np.ndarray, L: np.ndarray, q: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Stress rate (n, 3, 3) and internals' rates (n, k) at `stress`, `L` (n, 3, 3) and internals `q` (n, k)."""
        laws = self.constitutive.laws
        with blame(self.who):
            law = user_law(self.space, self.material, laws.Params, laws.internal)
            return self._pair(_rate_kernel(self.space, law, laws.Params, laws.internal), [stress, L], q)

    def project(self, stress: np.ndarray, q: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n, 3, 3) and internals (n, k) that the way back to the yield surface gives."""
        laws = self.constitutive.laws
        with blame(self.who, PROJECT_SIGNATURE):
            back = self.material.project(self.space, laws.Params)
            made = _project_kernel(self.space, back, laws.Params, laws.internal, len(self.names))
            return self._pair(made, [stress], q)

    def total(self, H: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cauchy stress and first Piola stress (n, 3, 3), and the energy per reference volume (n,), zero where the
        material gives none, of displacement gradients H (n, 3, 3)."""
        params, material, n = self.constitutive.laws.Params, self.material, len(H)
        with blame(self.who, TOTAL_SIGNATURE):
            piola = material.piola(self.space, params) if gives(material, "piola") else None
            stored = material.energy(self.space, params) if gives(material, "energy") else None
            made = _total_kernel(self.space, params, material.stress(self.space, params), piola, stored)
            arrays = [wp.zeros(n, dtype=self.space.tensor, device="cpu") for _ in range(2)]
            energy = wp.zeros(n, dtype=self.space.scalar, device="cpu")
            gradients = wp.array(H, dtype=self.space.tensor, device="cpu")
            wp.launch(made, n, inputs=[self.constitutive.params, gradients], outputs=[*arrays, energy], device="cpu")
        cauchy, piola = (array.numpy().astype(float).reshape(n, 3, 3) for array in arrays)
        return cauchy, piola, energy.numpy().astype(float)

    def _pair(self, made: wp.Kernel, tensors: list[np.ndarray], q: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Launch a kernel of tensors and internals that gives one of each."""
        internal, n = self.constitutive.laws.internal, len(tensors[0])
        internals = np.zeros((n, internal._length_))
        internals[:, : len(self.names)] = np.tile(self.initial, (n, 1)) if q is None else q
        arrays = [wp.array(each, dtype=self.space.tensor, device="cpu") for each in tensors]
        arrays.append(wp.array(internals, dtype=internal, device="cpu"))
        first, second = wp.zeros_like(arrays[0]), wp.zeros_like(arrays[-1])
        wp.launch(made, n, inputs=[self.constitutive.params, *arrays], outputs=[first, second], device="cpu")
        kept = second.numpy().astype(float).reshape(n, internal._length_)[:, : len(self.names)]
        return first.numpy().astype(float).reshape(n, 3, 3), kept


@cache
def _rate_kernel(space: Space, law: wp.Function, Params: type, internal: type) -> wp.Kernel:
    tensor = space.tensor

    @kernel()
    def sample(
        p: Params,
        stress: wp.array(dtype=tensor),
        L: wp.array(dtype=tensor),
        q: wp.array(dtype=internal),
        rate_out: wp.array(dtype=tensor),
        change_out: wp.array(dtype=internal),
    ):
        i = wp.tid()
        rate, change = law(p, stress[i], L[i], q[i])
        rate_out[i] = rate
        change_out[i] = change

    return sample


@cache
def _project_kernel(space: Space, back: wp.Function, Params: type, internal: type, count: int) -> wp.Kernel:
    tensor, own = space.tensor, space.vector(max(count, 1))

    @kernel()
    def bring_back(
        p: Params,
        stress: wp.array(dtype=tensor),
        q: wp.array(dtype=internal),
        stress_out: wp.array(dtype=tensor),
        q_out: wp.array(dtype=internal),
    ):
        i = wp.tid()
        if wp.static(count > 0):
            mine = own()
            for k in range(wp.static(count)):
                mine[k] = q[i][k]
            allowed, changed = back(p, stress[i], mine)
            kept = internal()
            for k in range(wp.static(count)):
                kept[k] = changed[k]
            stress_out[i] = allowed
            q_out[i] = kept
        else:
            stress_out[i] = back(p, stress[i])

    return bring_back


@cache
def _total_kernel(
    space: Space, Params: type, law: wp.Function, nominal: wp.Function | None, stored: wp.Function | None
) -> wp.Kernel:
    tensor, real = space.tensor, space.scalar
    direct, has_energy = nominal is not None, stored is not None

    @kernel()
    def deform(
        p: Params,
        H: wp.array(dtype=tensor),
        cauchy_out: wp.array(dtype=tensor),
        piola_out: wp.array(dtype=tensor),
        energy_out: wp.array(dtype=real),
    ):
        i = wp.tid()
        cauchy = law(p, H[i])
        F = wp.identity(n=3, dtype=real) + H[i]
        cauchy_out[i] = cauchy
        if wp.static(direct):
            piola_out[i] = nominal(p, H[i])
        else:
            piola_out[i] = wp.determinant(F) * cauchy * wp.transpose(wp.inverse(F))
        if wp.static(has_energy):
            energy_out[i] = stored(p, H[i])

    return deform


@contextmanager
def law_named(material: Material, who: str) -> Generator[None]:
    """Where what is done with a material fails in a plugin's code, and its laws fail by themselves, it is the material
    that is named. Raises PluginError."""
    try:
        yield
    except Exception as error:
        others = isinstance(error, (WsphError, OSError)) and not isinstance(error, PluginError)
        if others or is_out_of_memory(error) or who in str(error):
            raise
        if fault := fault_of_law(material, who):
            raise PluginError(fault) from error
        raise


def fault_of_law(material: Material, who: str, stressed: bool = False) -> str:
    """What is wrong with a material's laws by themselves, "" where nothing is: small strains of random directions have
    to give numbers; where it is to be `stressed`, also at stresses of up to a tenth of the shear modulus. Raises
    PluginError where a law does not compile."""
    sampler, random = LawSampler(material, who=who), np.random.default_rng(0)
    L, directions = (random.standard_normal((_TRIED, 3, 3)) for _ in range(2))
    directions = directions + np.swapaxes(directions, 1, 2)
    for level in (0.0, 1e-3, 1e-2, 1e-1) if stressed else (0.0,):
        stress, strain = level * sampler.shear * directions, max(level, 1e-3) * L
        tried = {
            "rate": lambda stress=stress, strain=strain: sampler(stress, strain),
            "stress": lambda strain=strain: sampler.total(strain)[:1],
            "project": lambda stress=stress: sampler.project(stress),
        }
        for member, law in tried.items():
            if gives(material, member) and not all(np.isfinite(found).all() for found in law()):
                size = level * sampler.shear * sampler.scales.stress
                where = f"at stresses of {size:.3g} Pa" if level else "for small strains"
                return f"{who}: its `{member}` gives numbers that are not finite {where}"
    return ""
