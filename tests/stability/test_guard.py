"""The limits that the guard finds, beside where runs begin to grow and beside the spectra of whole bodies."""

import warnings
from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from wsph_integrators.chebyshev import Coefficients
from wsph_integrators.runge_kutta import Euler, Midpoint, RungeKutta4
from wsph_integrators.symplectic import Leapfrog

import wsph
from tests import scenes
from tests.scenes import FORMS
from wsph.simulation.compose import compose
from wsph.stability.regions import damped_limit, margin
from wsph.stability.spectrum import modes
from wsph.testing import spectral_radius, whole_spectrum
from wsph.validation.case import example
from wsph.validation.he_seaid import WINDOW, at_courant, damped_beam, fastest, holds
from wsph.validation.oracles import MAGNESIUM_SPEED


def block(alpha: float, jitter: float = 0.0, *, coefficient: float | None = None, model: str = "elastic", dim: int = 2,
          cells: int = 9, **run: Any) -> wsph.Scene:  # fmt: skip
    """A free block of cells with viscosity on all pairs, held by hourglass control, by its residual (None) or not (0)."""
    parts: dict[str, Any] = {"viscosity": {"alpha": alpha, "kind": "pair"}} if alpha else {}
    if coefficient is not None:
        parts |= {"hourglass": {"coefficient": coefficient}} if coefficient else {"residual": False}
    keys = {"formulation": "total-lagrangian", "dt": 1e-3, "guard": "off"}
    return scenes.block(dim, cells, model=model, run=keys | run, jitter=jitter, **parts)


def blocks() -> Iterator[dict[str, Any]]:
    """The blocks whose whole spectra are known."""
    jitters = [(0.0, 1), (0.2, 2), (0.4, 1), (0.4, 2)]
    total = [{"coefficient": None}, {"coefficient": 0.1}]
    updated: list[dict[str, Any]] = [{"coefficient": 0, "formulation": "updated-lagrangian"}]
    rates = [{"coefficient": 0.1, "model": "jaumann"}, *({**each, "model": "jaumann"} for each in updated)]
    points: list[dict[str, Any]] = [
        {"formulation": "stress-points"},
        {"formulation": "stress-points", "model": "jaumann"},
    ]
    for size in (
        {"cells": 9},
        {"cells": 16},
        {"cells": 9, "support": 2.1},
        {"cells": 9, "support": 3.6},
        {"dim": 3, "cells": 5},
    ):
        sized = "support" in size
        for form in (*total, *updated, *([] if sized else rates), *([] if sized else points)):
            for alpha in (0.05, 0.3, 1.0, 2.5):
                for jitter, seed in jitters:
                    yield {"alpha": alpha, "jitter": jitter, "seed": seed, **size, **form}


def evaluations(system: Any) -> int:
    """Right-hand sides that the spectrum of a body takes: evaluations of the velocity's rate."""
    count, rate = 0, system.rate

    def counted(state: Any, out: Any, part: str = "all", ahead: float = 0.0) -> None:
        nonlocal count
        count += part != "rest"
        rate(state, out, part, ahead)

    system.rate = counted
    system.forget_motions()
    assert system.frequency > 0.0
    system.rate = rate
    return count


METHODS = [("euler", Euler), ("rk2", Midpoint), ("rk4", RungeKutta4), ("rkc", 3), ("rkc", 5), ("rkc", 10)]


def gaps(scene: wsph.Scene) -> dict[str, tuple[float, float]]:
    """The limits found with some tens of right-hand sides over those of the whole spectrum, and by how much a step at the
    former multiplies the motion that grows fastest, less 1."""
    system = compose(scene).bodies[0].system
    known = {name: getattr(system, name) for name in ("frequency", "stabilisation", "irregular", "space", "points")}
    shared = known | {"courant": lambda product: product / system.frequency, "damped": True}
    K, D = whole_spectrum(system)

    def largest(dt: float, factor: float) -> float:
        return float(np.linalg.eigvals(dt**2 * K + factor * dt * D).real.max())

    few = SimpleNamespace(modes=system.modes, largest=system.largest, **shared)
    every = modes(K, D)
    whole = SimpleNamespace(modes=every, largest=largest, **shared | {"irregular": False})
    found = {}
    for name, method in METHODS:
        if isinstance(method, int):
            amplification, stages, order, amplifies = Coefficients(method).amplification, method, 2, True
        else:
            amplification, stages = partial(np.polynomial.polynomial.polyval, c=method.polynomial()), len(method.b)
            order, amplifies = method.order, name != "rk4"
        if amplifies and system.points:  # what gradients of points do not see stays undamped
            continue
        predicted, _ = damped_limit(few, amplification, stages, margin(few, order, amplifies))
        exact, _ = damped_limit(whole, amplification, stages, 1.0)
        found[f"{name} {stages}"] = predicted / exact, float(np.abs(amplification(predicted * every)).max()) - 1.0
    for lagged in (False, True):
        limits = [Leapfrog.limit(SimpleNamespace(system=each, lagged=lagged))[0] for each in (few, whole)]  # type: ignore[arg-type]
        found[f"leapfrog, lagged {lagged}"] = 0.98 * limits[0] / limits[1], 0.0
    return found


DEMANDING = [
    {"alpha": 0.1, "jitter": 0.4},
    {"alpha": 0.5, "jitter": 0.4, "coefficient": 0.1},
    {"alpha": 2.5, "jitter": 0.4, "seed": 2},
    {"alpha": 0.25, "coefficient": 0, "formulation": "updated-lagrangian", "support": 3.6},
    {"alpha": 0.25, "jitter": 0.2, "coefficient": 0.1, "dim": 3, "cells": 5},
    {"alpha": 2.5, "jitter": 0.4, "coefficient": 0.1, "model": "jaumann"},
    {"alpha": 0.05, "jitter": 0.2, "formulation": "stress-points", "model": "jaumann"},
]


class TestWholeSpectra:
    """Some tens of right-hand sides against all modes of a body."""

    @pytest.mark.parametrize("which", DEMANDING, ids=str)
    def test_never_above(self, which: dict[str, Any]) -> None:
        """Below the step at which the first mode grows; of RKC where most modes are overdamped, and modes that are not grow
        by a few thousandths a step beyond it, below the one at which any grows by a hundredth."""
        for name, (ratio, growth) in gaps(block(**which)).items():
            assert ratio > 0.5
            assert ratio < 1.0 or (name.startswith("rkc") and which["alpha"] > 2.0 and growth < 0.01), (
                name,
                ratio,
                growth,
            )

    @pytest.mark.slow
    @pytest.mark.parametrize("which", list(blocks()), ids=str)
    def test_never_above_for_any_block(self, which: dict[str, Any]) -> None:
        self.test_never_above(which)

    @pytest.mark.parametrize("model", ["elastic", "jaumann"])
    @pytest.mark.parametrize("formulation", ["total-lagrangian", "stress-points", "updated-lagrangian"])
    @pytest.mark.parametrize(("alpha", "kind", "most"), [(0.0, "pair", 21), (0.5, "pair", 50), (0.5, "approach", 50)])
    def test_it_takes_fifty_evaluations_at_most(
        self, alpha: float, kind: str, most: int, formulation: str, model: str
    ) -> None:
        scene = block(alpha, model=model, formulation=formulation)
        if alpha:
            scene = scene.with_(**{"bodies.0.viscosity.kind": kind})
        assert evaluations(compose(scene).bodies[0].system) <= most


def beam(integrator: str, formulation: str = "stress-points", **run: Any) -> wsph.Scene:
    """The oscillating beam with six rows, for half a period."""
    run |= {"integrator": integrator, "formulation": formulation, "end": np.pi / 2008.5}
    size = {"bodies.0.spacing": 0.1 / 6, "probes": []}
    return example("oscillating_beam").with_(**size, **{f"run.{key}": value for key, value in run.items()})


@pytest.mark.parametrize("stages", [2, 3, 5, 10])
def test_undamped_waves_grow_with_chebyshev_at_every_courant_number(stages: int) -> None:
    """The spectral radius of the program's own step of a bar held at one end."""
    run = {
        "integrator": {"name": "rkc", "stages": stages},
        "formulation": "total-lagrangian",
        "end": 100.0,
        "cfl": 0.1,
        "guard": "off",
    }
    scene = scenes.block(1, 12, run=run, tables={"boundary": [scenes.held("-x", 1)]})
    grown = [spectral_radius(scene.with_(cfl=courant), 1e-6) - 1.0 for courant in (0.05, 0.1, 0.2, 0.4, 0.8)]
    assert grown[0] > 1e-8
    assert all(longer > 4.0 * shorter for shorter, longer in pairwise(grown)), grown
    assert spectral_radius(scene.with_(cfl=0.8, integrator="rk4"), 1e-6) < 1.0 + 1e-8


def predicted(scene: wsph.Scene, integrator: str) -> float:
    """The guard's Courant number of c = sqrt(E/rho) for a method of the table of stability."""
    composition = compose(at_courant(scene, integrator, 0.01))
    run = composition.bodies[0]
    assert run.limit is not None
    return run.limit * MAGNESIUM_SPEED / run.constitutive.wave_speed


class TestRuns:
    """The predicted limit beside where runs begin to grow."""

    @pytest.mark.parametrize("formulation", FORMS)
    @pytest.mark.parametrize("name", ["leapfrog", "rk4", "kg4-8", "lf4"])
    def test_predicted_over_measured(self, name: str, formulation: str) -> None:
        scene = beam(name, formulation, cfl=0.1, guard="off")
        limit = compose(scene).bodies[0].limit
        assert limit is not None

        def grows(cfl: float) -> bool:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                result = wsph.run(scene.with_(cfl=cfl, stop={"energy": 1e6}), throw=False)
            return result.status != "completed" or result.history["kinetic"].max() > 2.0 * result.history["kinetic"][0]

        assert not grows(limit)
        assert grows(limit / 0.97)

    @pytest.mark.parametrize("correction", ["symmetric", pytest.param("paper", marks=pytest.mark.slow)])
    @pytest.mark.parametrize("alpha", [0.25, 2.5])
    @pytest.mark.parametrize("name", ["leapfrog", "rk4", "rkc 3", "rkc 5", "rkc 10"])
    def test_within_eight_per_cent_with_damping_of_all_pairs(self, name: str, alpha: float, correction: str) -> None:
        """The ten rows of the table of stability, whose criterion it is: below 1.6 v0 from 0.8 to 1.5 ms. (Ten stages with
        the paper's viscosity, alpha = 2.5, hold 9 % beyond.)"""
        least = 0.9 if (name, alpha, correction) == ("rkc 10", 2.5, "paper") else 0.92
        scene = damped_beam(alpha, correction)
        limit, most = predicted(scene, name), 1.6 * fastest(scene)
        assert holds(scene, name, limit, most, WINDOW)
        assert not holds(scene, name, limit / least, most, WINDOW)

    @pytest.mark.parametrize(("alpha", "name", "least"), [
        *((2.5, name, 0.8) for name in ("euler", "pc2", "leapfrog", "rk4", "rkc 3", "rkc 5", "rkc 10")),
        *((1.0, name, 0.8) for name in ("pc2", "leapfrog", "rk4", "rkc 3", "rkc 5", "rkc 10")), (1.0, "euler", 0.7),
    ])  # fmt: skip
    def test_within_twenty_per_cent_on_the_switched_viscous_bar(self, alpha: float, name: str, least: float) -> None:
        """Below 2.3 v0 at 0.4 ms. (Euler at alpha = 1 grows so slowly that the window decides: it holds 0.62 for 0.12 ms,
        0.51 for 0.4 ms and 0.33 for 8 ms; predicted 0.38.)"""
        bar = example("magnesium_bar").with_(
            guard="off", probes=[], **{"bodies.0.viscosity": {"alpha": alpha, "beta": alpha}}
        )
        limit = predicted(bar, name)
        assert holds(bar, name, limit, 2.3, (4e-4,))
        assert not holds(bar, name, limit / least, 2.3, (4e-4,))

    def test_beyond_it_is_refused_by_name(self) -> None:
        with pytest.raises(
            wsph.Refused, match=r"leapfrog at Courant number 1.2 is beyond its stability limit 0\.97.*omega dt <= 2"
        ):
            compose(beam("leapfrog", cfl=1.2))
        with pytest.raises(
            wsph.Refused,
            match=r"limit 0.000 \(RKC amplifies every undamped wave: give the body viscosity, or use leapfrog",
        ):
            compose(beam("rkc", cfl=0.1))
        with pytest.raises(
            wsph.Refused, match="rk2 .*limit 0.000 .*amplifies every undamped wave: use leapfrog or rk4"
        ):
            compose(beam("rk2", cfl=0.1))
