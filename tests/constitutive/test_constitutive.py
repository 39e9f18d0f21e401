"""Stress states by probing: closed forms of every state, free faces, dissipation, and who is blamed for a broken law."""

from dataclasses import dataclass, field

import numpy as np
import pytest
import warp as wp
from wsph_materials.elastic import Elastic
from wsph_materials.perzyna import Perzyna

from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import STRESS_STATES, StressState
from wsph.errors import PluginError
from wsph.plugins.blame import blame
from wsph.units import Scales

E, NU, RHO = 3.0, 0.3, 2.0


def evaluate(
    space: Space, constitutive: Constitutive, stress: np.ndarray, L: np.ndarray, mask: int = 0, target=(0.0, 0.0, 0.0)
) -> np.ndarray:
    """Stress rates by the laws: `respond` without a mask, `linear_faces` with one (from a zero source)."""
    laws: Laws = constitutive.laws
    respond, faces, vec, mat, internal, point = (
        laws.respond,
        laws.linear_faces,
        laws.stress,
        space.mat,
        laws.internal,
        space.point,
    )
    Params = laws.Params

    @wp.kernel(module="unique", enable_backward=False)
    def run(
        p: Params,
        s: wp.array(dtype=vec),
        L: wp.array(dtype=mat),
        mask: int,
        target: point,
        rate_out: wp.array(dtype=vec),
    ):
        if mask == 0:
            rate, _ = respond(p, s[0], L[0], internal())
            rate_out[0] = rate
        else:
            rate, _ = faces(p, s[0], L[0], internal(), vec(), internal(), mask, target)
            rate_out[0] = rate

    arrays = [wp.array([v], dtype=t, device="cpu") for v, t in ((stress, vec), (L, mat))]
    out = wp.zeros(1, dtype=vec, device="cpu")
    wp.launch(run, 1, inputs=[constitutive.params, *arrays, mask, point(*target)], outputs=[out], device="cpu")
    return out.numpy().reshape(-1).astype(float)


def elastic(dim: int, name: str | None, precision: str = "f64") -> tuple[Space, Constitutive]:
    """Elasticity in a stress state, in unit scales."""
    space = Space(dim, precision)
    return space, Constitutive(space, Elastic(RHO, E, NU), STRESS_STATES[dim, name], Scales(1.0, 1.0, 1.0), "elastic")


LAMBDA, MU = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_every_stress_state_against_its_closed_form(precision: str) -> None:
    gate = 4e-16 * 10 if precision == "f64" else 2e-6
    L1, L2 = np.array([[0.7]]), np.array([[0.7, 0.2], [-0.5, 0.4]])
    D2 = 0.5 * (L2 + L2.T)
    plane = E / (1 - NU**2)
    cases = [
        (1, "stress", L1, [E * 0.7]),
        (1, "strain", L1, [(LAMBDA + 2 * MU) * 0.7, LAMBDA * 0.7, LAMBDA * 0.7]),
        (2, "stress", L2, [plane * (0.7 + NU * 0.4), plane * (0.4 + NU * 0.7), 2 * MU * D2[0, 1]]),
        (2, "strain", L2, [LAMBDA * 1.1 + 2 * MU * 0.7, LAMBDA * 1.1 + 2 * MU * 0.4, LAMBDA * 1.1, 2 * MU * D2[0, 1]]),
    ]
    for dim, name, L, expected in cases:
        space, constitutive = elastic(dim, name, precision)
        np.testing.assert_allclose(
            evaluate(space, constitutive, np.zeros(len(expected)), L), expected, rtol=gate, atol=gate
        )
    space, constitutive = elastic(3, None, precision)
    L3 = np.random.default_rng(0).standard_normal((3, 3))
    full = LAMBDA * np.trace(L3) * np.eye(3) + MU * (L3 + L3.T)
    expected = [full[i, j] for i, j in STRESS_STATES[3, None].components]
    np.testing.assert_allclose(evaluate(space, constitutive, np.zeros(6), L3), expected, rtol=gate, atol=gate)


def test_a_face_with_prescribed_stress_finds_its_strain_rate() -> None:
    space, constitutive = elastic(2, "strain")
    rate = evaluate(
        space, constitutive, np.zeros(4), np.array([[0.7, 0.0], [0.0, 9.0]]), mask=2, target=(0.0, 0.25, 0.0)
    )
    assert rate[1] == pytest.approx(0.25, abs=1e-14)  # whatever L_yy came in
    yy = (0.25 - LAMBDA * 0.7) / (LAMBDA + 2 * MU)
    assert rate[0] == pytest.approx((LAMBDA + 2 * MU) * 0.7 + LAMBDA * yy, rel=1e-13)
    space, constitutive = elastic(2, "stress")
    rate = evaluate(space, constitutive, np.zeros(3), np.array([[0.7, 0.0], [0.0, 9.0]]), mask=2)
    assert rate[0] == pytest.approx(E * 0.7)  # both normals free: uniaxial stress


@pytest.mark.parametrize(("dim", "name"), list(STRESS_STATES))
def test_wave_speeds(dim: int, name: str | None) -> None:
    bulk, shear = Elastic(RHO, E, NU).moduli()
    modulus = {(1, "stress"): E, (2, "stress"): E / (1 - NU**2)}.get((dim, name), LAMBDA + 2 * MU)
    assert STRESS_STATES[dim, name].wave_speed(bulk, shear, RHO) == pytest.approx(np.sqrt(modulus / RHO), rel=1e-14)


def test_dissipation_of_perzyna_in_uniaxial_stress_is_stress_times_plastic_rate() -> None:
    space = Space(1)
    material = Perzyna(1.0, 1.0, 0.25, yield_stress=0.01, hardening_modulus=0.0, fluidity=3.0, exponent=1.0)
    constitutive = Constitutive(space, material, STRESS_STATES[1, "stress"], Scales(1.0, 1.0, 1.0), "perzyna")
    assert list(constitutive.internals) == ["plastic_strain", "dissipation"]
    source, vec, internal, Params = (
        constitutive.laws.source,
        constitutive.laws.stress,
        constitutive.laws.internal,
        constitutive.laws.Params,
    )

    @wp.kernel(module="unique", enable_backward=False)
    def run(p: Params, s: vec, rate_out: wp.array(dtype=vec), q_out: wp.array(dtype=internal)):
        rate, q = source(p, s, internal())
        rate_out[0] = rate
        q_out[0] = q

    rate, q = wp.zeros(1, dtype=vec, device="cpu"), wp.zeros(1, dtype=internal, device="cpu")
    wp.launch(run, 1, inputs=[constitutive.params, vec(-0.025)], outputs=[rate, q], device="cpu")
    plastic = 3.0 * (0.025 - 0.01) / 0.01
    assert rate.numpy().item() == pytest.approx(plastic, rel=1e-12)  # -E times the plastic rate, against the stress
    assert q.numpy().reshape(-1).tolist() == pytest.approx([plastic, 0.025 * plastic], rel=1e-12)


@dataclass(frozen=True)
class Wrong:
    """A law with too few arguments."""

    density: float = field(default=1.0, metadata={"unit": "kg/m3"})
    mistake: str = "arity"

    def moduli(self) -> tuple[float, float]:
        """Some moduli."""
        return 1.0, 1.0

    def rate(self, space, Params):
        """A law with a mistake."""
        tensor = space.tensor

        @wp.func
        def two(p: Params, stress: tensor) -> tensor:
            return stress

        @wp.func
        def unknown(p: Params, stress: tensor, L: tensor) -> tensor:
            return stress * p.no_such_number

        return {"arity": two, "type": lambda p, s, L: s, "name": unknown}[self.mistake]


@pytest.mark.parametrize(
    ("mistake", "message"),
    [("arity", "takes 2 arguments, not 3"), ("type", "no @wp.func"), ("name", "plugin-x 1.0.*its code fails")],
)
def test_a_broken_law_is_blamed_on_its_plugin(mistake: str, message: str) -> None:
    with pytest.raises(PluginError, match=message) as caught:
        compile_law(Wrong(mistake=mistake), "material 'wrong' (plugin-x 1.0)")
    assert "expected rate(self, space, Params)" in str(caught.value)


def compile_law(material: Wrong, who: str) -> None:
    """Compile a law, blaming its plugin as a composition does."""
    state = StressState("uniaxial strain", ((0, 0),))
    constitutive = Constitutive(Space(1), material, state, Scales(1.0, 1.0, 1.0), who)
    with blame(who):
        evaluate(constitutive.space, constitutive, np.zeros(1), np.zeros((1, 1)))
