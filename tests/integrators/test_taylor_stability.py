"""Taylor-SPH in two and three dimensions: the spectrum of the program's own step on small blocks."""

import numpy as np
import pytest

import wsph
from wsph.composition import compose
from wsph.growth import largest_growth
from wsph.testing import spectral_radius, step_matrix

CONDITIONS: dict[str, list[dict]] = {
    "free": [],
    "fixed": [{"face": face, "fixed": ["x", "y"]} for face in ("-x", "+x", "-y", "+y")],
    "cantilever": [{"face": "-x", "fixed": ["x", "y"]}],
    "symmetry": [{"face": "-x", "symmetry": "x"}, {"face": "-y", "symmetry": "y"}],
    "corner-loaded": [
        {"face": "-x", "fixed": ["x", "y"]},
        {"face": "+x", "stress": {"xx": 1.0, "xy": 2.0}},
        {"face": "+y", "velocity": {"y": 3.0}},
    ],
}


def block(
    conditions: str = "free",
    *,
    cells: int = 5,
    courant: float = 0.8,
    poisson: float = 0.3,
    state: str | None = "strain",
    dim: int = 2,
    jitter: float = 0.0,
    support: float = 1.2,
    seed: int = 0,
) -> wsph.Scene:
    """A cube of `cells` cells along every edge."""
    axes = ["x", "y", "z"][:dim]
    boundary = [{"body": "block", **c} for c in CONDITIONS[conditions]]
    for condition in boundary:
        if "fixed" in condition:
            condition["fixed"] = axes
    body = {
        "name": "block",
        "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim},
        "spacing": 1.0 / cells,
        "jitter": jitter,
        "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": poisson},
    }
    if dim < 3:
        body["state"] = state
    run = {"integrator": "tsph", "end": 1.0, "cfl": courant, "guard": "off", "support": support, "seed": seed}
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=[body], boundary=boundary)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.499])
@pytest.mark.parametrize("conditions", list(CONDITIONS))
def test_no_mode_of_a_lattice_block_grows(conditions: str, poisson: float) -> None:
    for state in ("strain", "stress"):
        for courant in (0.05, 0.5, 0.9):
            scene = block(conditions, courant=courant, poisson=poisson, state=state)
            assert spectral_radius(scene) <= 1.0 + 1e-6, (state, courant)


def test_powers_of_the_step_stay_bounded() -> None:
    """A radius of 1 could hide a defective eigenvalue: ten thousand steps (2^13 and some) amplify nothing by 1e3."""
    matrix = step_matrix(block("cantilever", courant=0.5, poisson=0.499))
    power, largest = matrix, 0.0
    for _ in range(14):
        largest = max(largest, float(np.linalg.norm(power, 2)))
        power = power @ power
    assert largest < 1e3


def test_corners_grow_at_courant_one_where_the_guard_refuses_with_the_growth() -> None:
    assert spectral_radius(block("fixed", courant=1.0)) - 1.0 == pytest.approx(0.015, rel=0.01)
    with pytest.raises(wsph.Refused, match=r"limit 0.900 .*grows by 0.015 a step"):
        wsph.run(block("fixed", courant=1.0).with_(guard="refuse"))


@pytest.mark.parametrize(("conditions", "courant", "seed"), [("free", 0.5, 1), ("free", 0.7, 2), ("fixed", 1.0, 0)])
def test_the_growth_that_the_guard_finds_is_the_spectrum_s(conditions: str, courant: float, seed: int) -> None:
    scene = block(conditions, cells=7, courant=courant, jitter=0.2 if courant < 1.0 else 0.0, seed=seed)
    run = compose(scene).bodies[0]
    before = run.system.state.buffer.numpy().copy()
    assert largest_growth(run.integrator.step, run.system.state) == pytest.approx(spectral_radius(scene) - 1.0, rel=0.02)
    assert np.array_equal(run.system.state.buffer.numpy(), before)


def test_a_jittered_body_that_would_grow_is_refused_with_the_growth_found() -> None:
    """At C = .05 every jittered block grows; for C >= .5 those held on their faces do not, some free ones do."""
    grows = block("fixed", cells=7, courant=0.05, jitter=0.2, seed=1).with_(guard="refuse", end=30.0)
    with pytest.raises(wsph.Refused, match=r"grows by 0.00089 a step, 4\.\d+ e-folds in this run of .* steps"):
        compose(grows)
    with pytest.warns(RuntimeWarning, match="grows by"):
        compose(grows.with_(guard="warn"))
    compose(block("fixed", cells=7, courant=0.7, jitter=0.2, seed=1).with_(guard="refuse", end=30.0))


@pytest.mark.parametrize(("support", "jitter"), [(1.2, 0.2), (1.8, 0.4)])
def test_jittered_blocks_held_on_their_faces(support: float, jitter: float) -> None:
    """Stable for C >= .5; at C = .05 they grow by some 1e-3 per step."""
    for seed in range(3):
        for courant in (0.5, 0.7, 0.9):
            scene = block("fixed", cells=7, courant=courant, support=support, jitter=jitter, seed=seed)
            assert spectral_radius(scene) <= 1.0 + 1e-6, (seed, courant)
    slow = block("fixed", cells=7, courant=0.05, support=support, jitter=jitter, seed=1)
    assert 1e-5 < spectral_radius(slow) - 1.0 < 1e-2


@pytest.mark.parametrize("conditions", ["free", "fixed", "cantilever"])
def test_three_dimensions(conditions: str) -> None:
    for courant in (0.3, 0.9):
        scene = block(conditions, dim=3, cells=2, courant=courant)
        assert spectral_radius(scene) <= 1.0 + 1e-6, courant


@pytest.mark.parametrize("dim", [2, 3])
def test_a_slab_between_symmetric_faces_carries_the_wave_of_one_dimension(dim: int) -> None:
    """Uniaxial strain in 1D, 2D and 3D: the same front to rounding, at C = .9."""

    def stress(dimension: int) -> np.ndarray:
        sides = [
            {"body": "bar", "face": f"{sign}{axis}", "symmetry": axis}
            for axis in "yz"[: dimension - 1]
            for sign in "+-"
        ]
        body = {
            "name": "bar",
            "shape": {"type": "box", "min": [0.0] * dimension, "max": [1.0, 0.1, 0.1][:dimension]},
            "spacing": 0.05,
            "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3},
        }
        if dimension < 3:
            body["state"] = "strain"
        drive = {"body": "bar", "face": "-x", "velocity": {"x": 1.0}} | (
            {"fixed": ["y", "z"][: dimension - 1]} if dimension > 1 else {}
        )
        probe = {"name": "end", "at": [[1.0, 0.05, 0.05][:dimension]], "fields": ["stress_xx"]}
        fixed = {"body": "bar", "face": "+x", "fixed": ["x", "y", "z"][:dimension]}
        scene = wsph.Scene(
            schema=1, dim=dimension, run={"integrator": "tsph", "end": 2.5, "cfl": 0.9}, bodies=[body],
            boundary=[drive, fixed, *sides], probes=[probe],
        )  # fmt: skip
        return wsph.run(scene).probes["end"]["stress_xx"]

    line, slab = stress(1), stress(dim)
    assert np.abs(line).max() > 2.0
    assert np.abs(slab - line).max() < 1e-12 * np.abs(line).max()
