"""Quiet faces: plane P and S waves leave at normal incidence, and at an angle come back as Lysmer & Kuhlemeyer's closed form
says."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import body, box, material, scene
from wsph.expressions import compile_expression
from wsph.simulation.compose import compose

NU = 0.25
CP, CS = float(np.sqrt((1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)))), float(np.sqrt(0.5 / (1.0 + NU)))
SPEEDS = {"strain": CP, "stress": float(np.sqrt(1.0 / (1.0 - NU**2)))}
FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"}, {"formulation": "total-lagrangian"},
    {"formulation": "total-lagrangian", "support": 2.6, "placement": "nodes"},
    {"formulation": "updated-lagrangian", "placement": "nodes"},
]  # fmt: skip
CELLS, PULSE = 130, 9.0


def strip(wave: str, dim: int, state: str | None, placement: str | None = None, **run: Any) -> wsph.Scene:
    """A strip of two cells' width, quiet at both ends, from whose middle a pulse goes both ways, until what comes back from
    the ends would be in the middle again."""
    pulse = f"1e-4*exp(-((x - {CELLS / 2})/{PULSE})^2)"
    velocity: list[float | str] = [0.0] * dim
    velocity["PS".index(wave)] = pulse
    entries: list[dict[str, Any]] = [{"body": "b", "face": face, "quiet": True} for face in ("-x", "+x")]
    for axis in "yz"[: dim - 1]:
        still = [axis] if wave == "P" else [each for each in "xyz"[:dim] if each != "y"]
        entries += [{"body": "b", "face": sign + axis, "fixed": still} for sign in "+-"]
    keys = {"state": state} if state else {}
    shape = box((0.0, CELLS), *[(0.0, 2.0)] * (dim - 1))
    made = body(shape, 1.0, velocity=velocity, material=material(poisson_ratio=NU), placement=placement, **keys)
    speed = (1.0 if dim == 1 and state == "stress" else SPEEDS[state or "strain"]) if wave == "P" else CS
    return scene(made, run={"cfl": 0.4, "end": CELLS / speed, **run}, boundary=entries)


CASES = [("P", 1, "stress"), ("P", 1, "strain"), ("P", 2, "strain"), ("P", 2, "stress"), ("S", 2, "strain"), ("S", 2, "stress"), ("P", 3, None), ("S", 3, None)]  # fmt: skip


@pytest.mark.parametrize(("form", "wave", "dim", "state"), [
    (form, *case) for form in FORMS for case in CASES if "placement" not in form or case[1] < 3
], ids=str)  # fmt: skip
def test_a_plane_wave_leaves_at_normal_incidence(form: dict[str, Any], wave: str, dim: int, state: str | None) -> None:
    """Less than 1 % of its amplitude comes back, and what left is dissipated."""
    history = wsph.run(strip(wave, dim, state, **form)).history
    start = history["kinetic"][0]
    assert np.sqrt((history["kinetic"][-1] + history["strain"][-1]) / start) < 1e-2
    assert history["dissipated"][-1] == pytest.approx(start, rel=1e-3)


@pytest.mark.parametrize("integrator", ["rk4", "kg4-8"])
def test_other_integrators_let_waves_out_too(integrator: str) -> None:
    history = wsph.run(strip("P", 1, "stress", integrator=integrator)).history
    assert np.sqrt((history["kinetic"][-1] + history["strain"][-1]) / history["kinetic"][0]) < 1e-2


def reflections(angle: float, q: float) -> tuple[float, float]:
    """Amplitudes of the displacements of the P and the S wave that come back of a P wave which meets a viscous boundary at
    `angle` from its normal [rad]; q = c_s/c_p.

    With x along the normal, u = (cos a, sin a) exp(i(w t - k.x)) comes in, A (-cos a, sin a) and B (sin b, cos b) go back,
    sin b = q sin a. sigma_xx + rho c_p v_x = 0 and sigma_xy + rho c_s v_y = 0, divided by i w rho c_p, give both.
    """
    a, b = angle, np.arcsin(q * np.sin(angle))
    pressed = 2.0 * q * q * np.sin(a) ** 2 - 1.0
    coming = np.array([pressed + np.cos(a), -q * q * np.sin(2.0 * a) + q * np.sin(a)])
    back = np.array([pressed - np.cos(a), q * q * np.sin(2.0 * a) + q * np.sin(a)])
    turned = np.array([q * np.sin(2.0 * b) + np.sin(b), q * np.cos(2.0 * b) + q * np.cos(b)])
    found = np.linalg.solve(np.stack([back, turned], 1), -coming)
    return float(found[0]), float(found[1])


def test_the_closed_form() -> None:
    """Nothing comes back along the normal, all of it along the face; of P at 30 degrees less than 5 %."""
    assert reflections(0.0, CS / CP) == pytest.approx((0.0, 0.0), abs=1e-15)
    assert abs(reflections(np.radians(89.99), CS / CP)[0]) == pytest.approx(1.0, abs=1e-3)
    assert abs(reflections(np.radians(30.0), CS / CP)[0]) < 0.05


class Oblique:
    """A packet of P waves at an angle to the ends of a strip, as the mode phi = g(x) cos(k_x x) cos(k_y y) of one that
    slides along its sides, of 20 cells a wave: what it leaves is told apart by its potentials."""

    def __init__(self, degrees: float, form: dict[str, Any]):
        self.angle, cells, length, wide = np.radians(degrees), 20, 24.0, 2.0
        self.k = 2.0 * np.pi * np.array([np.cos(self.angle), np.sin(self.angle)])
        self.width = np.pi / self.k[1]
        self.h = self.width / round(self.width * cells)
        self.length = round(length / self.h) * self.h
        (kx, ky), x = self.k.tolist(), f"(x - {self.length / 2})"
        g = f"1e-4*exp(-({x}/{wide})^2)"
        self.velocity = [
            f"({g})*cos({ky}*y)*(-2*{x}/{wide**2}*cos({kx}*{x}) - {kx}*sin({kx}*{x}))",
            f"-({g})*{ky}*sin({ky}*y)*cos({kx}*{x})",
        ]
        block = body(
            box((0.0, self.length), (0.0, self.width)),
            [self.h, self.h],
            velocity=self.velocity,
            material=material(poisson_ratio=NU),
        )
        entries: list[dict[str, Any]] = [{"body": "b", "face": face, "quiet": True} for face in ("-x", "+x")]
        entries += [{"body": "b", "face": face, "symmetry": "y"} for face in ("-y", "+y")]
        end = 0.5 * self.length / (CP * np.cos(self.angle)) * 1.45
        self.result = wsph.run(scene(block, run={"end": end, "cfl": 0.35, **form}, boundary=entries))

    def energies(self, velocity: np.ndarray) -> tuple[float, float]:
        """Kinetic energies of P and of S waves, in one unit."""
        place = np.rint(self.result.particles["position"][:, :2] / self.h).astype(int)
        grid = np.zeros((*(place.max(0) + 1), 2))
        grid[place[:, 0], place[:, 1]] = velocity
        y = np.arange(grid.shape[1]) * self.h
        weight = np.where((y < 0.5 * self.h) | (y > self.width - 0.5 * self.h), 0.5, 1.0)
        a = np.fft.fft((grid[..., 0] * np.cos(self.k[1] * y) * weight).sum(1))
        b = np.fft.fft((grid[..., 1] * np.sin(self.k[1] * y) * weight).sum(1))
        # v = grad phi + curl psi: a = i K f + k_y g, b = -k_y f - i K g.
        K, ky = 2.0 * np.pi * np.fft.fftfreq(len(a), self.h), self.k[1]
        square = K**2 + ky**2
        f, g = (-1j * K * a - ky * b) / square, (1j * K * b + ky * a) / square
        return float((square * np.abs(f) ** 2).sum()), float((square * np.abs(g) ** 2).sum())

    def amplitudes(self) -> tuple[float, float]:
        """Those that came back, of P and of S waves. At the start all energy is kinetic, at the end half."""
        at = self.result.particles["position"][:, :2]
        start, _ = self.energies(np.stack([compile_expression(text)(at) for text in self.velocity], 1))
        p, s = self.energies(self.result.particles["velocity"][:, :2])
        turned = np.arcsin(CS / CP * np.sin(self.angle))
        # Of a packet that comes back slower the same energy is in a shorter one.
        flux = CP * np.cos(self.angle) / (CS * np.cos(turned))
        return float(np.sqrt(2.0 * p / start)), float(np.sqrt(2.0 * s / start * flux))


@pytest.mark.parametrize(("degrees", "form"), [(30.0, FORMS[0]), (30.0, FORMS[1]), (45.0, FORMS[0])], ids=str)
def test_a_wave_at_an_angle_comes_back_as_the_closed_form_says(degrees: float, form: dict[str, Any]) -> None:
    """Within 2 points, and of P at 30 degrees at most 5 %."""
    packet = Oblique(degrees, form)
    p, s = packet.amplitudes()
    exact = reflections(packet.angle, CS / CP)
    assert (p, s) == pytest.approx((abs(exact[0]), abs(exact[1])), abs=2e-2)
    assert degrees > 30.0 or p <= 0.05


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"formulation": "updated-lagrangian"},
            'boundary.0.quiet: needs particles on the faces: .* placement = "nodes"',
        ),
        ({"formulation": "total-lagrangian", "support": 2.6}, "boundary.0.quiet: needs particles on the faces"),
        ({"integrator": "tsph"}, "boundary.0.quiet: two-set bodies prescribe stress"),
        ({"integrator": "lf4"}, "no damping"),
    ],
)
def test_what_has_no_quiet_faces_says_so(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(wsph.SceneError, match=message):
        compose(strip("P", 2, "strain", **keys))


def test_false_says_nothing() -> None:
    entry = {"body": "b", "face": "+x", "quiet": False}
    with pytest.raises(wsph.SceneError, match=r"boundary.0.quiet: false says nothing"):
        scene(body(box(1.0, 1.0), 0.25), boundary=[entry])
