"""The guard: a time step beyond what an integrator or a material can take is refused, or warned of, by name."""

# pyright: strict

from collections.abc import Callable
from typing import Protocol

import numpy as np

from wsph.backend.domain import Domain, Share
from wsph.doubts import doubt
from wsph.errors import Refused
from wsph.plugins.integrators import begin
from wsph.protocols import BodySystem, LimitedBody
from wsph.scene.scene import Scene
from wsph.stability.growth import largest_growth
from wsph.stability.limit import SLACK
from wsph.stability.margins import PRODUCTS
from wsph.units import rounded_down

GROWN = 10.0
"""A mode that a run amplifies by more than this is refused or warned of."""

MOST_TRIED = 2e9
"""Particles times steps up to which the growth of a jittered body's step is tried: some minutes on one core."""


class SharedSystem(BodySystem, Protocol):
    """The system of a body that processes share, with the part of its particles that this one has."""

    @property
    def share(self) -> Share: ...

    @property
    def domain(self) -> Domain: ...


class SharedBody(LimitedBody, Protocol):
    """A body in a run that processes share."""

    @property
    def system(self) -> SharedSystem: ...


Again = Callable[[], SharedBody]
"""Makes a body once more, in double precision."""


def _growth(run: SharedBody, steps: int) -> float:
    """The growth per step of the body's own modes, measured with about as many steps as the run has."""
    system = run.system
    speed = run.constitutive.wave_speed / system.scales.velocity
    units = {"velocity": speed, "stress": system.density * speed**2}
    # Bodies of one set, which have fields at points too, are whole here.
    share, block = None if system.traits.one_set else system.share, int(np.clip(steps // PRODUCTS, 10, 100))
    found = largest_growth(run.integrator.step, system.state, block, PRODUCTS, units, share, system.domain)
    # What the trial leaves behind, up to infinities, must not reach the run.
    system.arrays.reset()
    system.start_works()
    begin(run.integrator)
    return found


def guard(scene: Scene, run: SharedBody, dt: float, steps: int, double: Again | None) -> None:
    """Refuse or warn of a time step beyond what the integrator or the material can take.

    Limits hold for lattices. A body with jitter is tried, as `double`, the same in double precision: where a mode of its own
    step grows so that the run would amplify it by more than GROWN, that is said with the growth; without `double` none is.
    """
    if scene.run.guard == "off":
        return
    faults: list[str] = []
    beyond = run.limit is not None and run.courant > run.limit * (1.0 + SLACK)
    if run.limit is not None and beyond:
        grows = ""
        if double is not None and scene.dim > 1 and run.system.share.whole * PRODUCTS * 25 < MOST_TRIED:
            found = _growth(double(), 25 * PRODUCTS)
            pace = f"by {found:.2g} a step" if np.isfinite(found) else "faster than can be measured"
            grows = f"; a mode of its step grows {pace}" if found > 0.0 else ""
        way_out = f"; use run.cfl <= {np.floor(run.limit * 1e6 * (1.0 + 1e-12)) / 1e6:g}" if run.limit > 0.0 else ""
        faults.append(
            f"body {run.body.name!r}: {scene.run.integrator.name} at Courant number {run.courant:.6g} is beyond its stability"
            f" limit {run.limit:.3f} ({run.limit_reason}){grows}{way_out}"
        )
    elif (
        double is not None
        and run.body.jitter > 0.0
        and run.system.traits.tried
        and run.system.share.whole * steps < MOST_TRIED
    ):
        found = _growth(double(), steps)
        if found * steps > np.log(GROWN):
            faults.append(
                f"body {run.body.name!r}: with jitter = {run.body.jitter:g} a mode of its step grows by {found:.2g} a step,"
                f" {found * steps:.3g} e-folds in this run of {steps} steps; use less jitter, a larger run.cfl or run.support = 1.8"
            )
    for name, longest in run.longest_steps.items():
        if dt > longest * (1.0 + SLACK):
            at_most = rounded_down(longest, 4)
            faults.append(
                f"body {run.body.name!r}: a time step of {dt:.4g} s is beyond what {name} can take, limit {at_most} s; use"
                f" run.dt <= {at_most}"
            )
    if faults and scene.run.guard == "refuse":
        raise Refused("\n".join(f'{f}; run.guard = "warn" runs it all the same' for f in faults))
    for fault in faults:
        doubt(fault, stacklevel=2)
