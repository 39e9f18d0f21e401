"""The extremes: a pairwise grid over methods, materials, dimensions and what makes scenes hard, and what became of each.

    python tests/extremes/grid.py            run all of it and write docs/benchmarks/extremes.md
    python tests/extremes/grid.py 17         one case, in both precisions

A case is 200 steps of a body that is held at one side and set in motion. It may complete, with its energy and its single
precision within bounds, or be refused by name before it starts, or be warned of or stopped by name: anything else is a
silent failure.
"""

import argparse
import itertools
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import wsph
from wsph.errors import WsphError
from wsph.plugins.formulations import FORMULATIONS
from wsph.simulation.compose import compose

STEPS = 200
CREATED = 0.02
"""Energy that may be created, of the largest seen: above it a run warns by itself."""
APART = 0.02
"""How far velocities in single precision may be from those in double, of the largest velocity."""

LEVELS: dict[str, tuple[Any, ...]] = {
    "method": (
        ("tsph", "small-strain"), ("ul-tsph", "updated-lagrangian"),
        ("leapfrog", "stress-points"), ("leapfrog", "total-lagrangian"), ("leapfrog", "updated-lagrangian"),
        ("rk4", "stress-points"), ("rk4", "total-lagrangian"), ("rk4", "updated-lagrangian"),
        ("rkc", "total-lagrangian"), ("rkc", "updated-lagrangian"),
        ("euler", "total-lagrangian"), ("rk2", "updated-lagrangian"), ("pc2", "total-lagrangian"),
        ("lf4", "stress-points"), ("blanes-moan4", "total-lagrangian"), ("kg4-8", "stress-points"), ("w20-2-8", "total-lagrangian"),
    ),
    "material": ("elastic", "jaumann", "perzyna", "mises", "neo-hookean"),
    "dim": (1, 2, 3),
    "fraction": (0.1, 0.5, 0.95),
    "support": (None, 0.8, 1.3, 2.0),
    "jitter": (0.0, 0.2, 0.4),
    "poisson": (0.0, 0.3, 0.49, 0.4999, -0.5),
    "size": ("1 m", "nm", "km", "years"),
    "extreme": ("none", "stretch 2", "turned by 1000 rad", "far from the origin", "thin cells", "softening", "few cells", "light and stiff neighbour"),
}  # fmt: skip
"""Factors and their levels. `fraction` is of the composed limit; `support` in that of the method's own, up to the largest
that it takes."""


def goes_together(row: dict[str, Any]) -> bool:
    """Whether a method takes a material at all: what it never takes is refused in the tests of compositions."""
    if row["method"][0] in ("tsph", "ul-tsph"):
        return row["material"] != "neo-hookean"
    return row["method"][0] != "lf4" or row["material"] in ("elastic", "neo-hookean")


@dataclass(frozen=True)
class Case:
    """One row of the grid."""

    number: int
    keys: tuple[tuple[str, Any], ...]

    def __getitem__(self, name: str) -> Any:
        return dict(self.keys)[name]

    def __str__(self) -> str:
        integrator, formulation = self["method"]
        rest = [f"{self['material']}, {self['dim']}D", f"{self['fraction']:g} of the limit"]
        rest += [f"support x {self['support']:g}"] if self["support"] else []
        rest += [f"jitter {self['jitter']:g}"] if self["jitter"] else []
        rest += [f"nu {self['poisson']:g}", self["size"]]
        rest += [self["extreme"]] if self["extreme"] != "none" else []
        return f"{integrator} {formulation}: " + ", ".join(rest)


def cases() -> list[Case]:
    """Rows that hold every pair of levels of two factors that go together at least once, chosen greedily, and more of the
    papers' methods: always the same."""
    names = list(LEVELS)
    open_pairs = {
        (a, x, b, y)
        for a, b in itertools.combinations(range(len(names)), 2)
        for x in range(len(LEVELS[names[a]]))
        for y in range(len(LEVELS[names[b]]))
        if {names[a], names[b]} != {"method", "material"}
        or goes_together({names[a]: LEVELS[names[a]][x], names[b]: LEVELS[names[b]][y]})
    }
    random, rows = np.random.default_rng(4), []
    while open_pairs:
        left, best, most = sorted(open_pairs), None, -1
        for _ in range(60):
            a, x, b, y = left[random.integers(len(left))]
            row: list[int] = [int(random.integers(len(LEVELS[n]))) for n in names]
            row[a], row[b] = x, y
            if not goes_together({n: LEVELS[n][k] for n, k in zip(names, row, strict=True)}):
                continue
            found = sum((a, row[a], b, row[b]) in open_pairs for a, b in itertools.combinations(range(len(names)), 2))
            if found > most:
                best, most = row, found
        if best is None:
            continue
        open_pairs -= {(a, best[a], b, best[b]) for a, b in itertools.combinations(range(len(names)), 2)}
        rows.append(best)
    found = [
        Case(number, tuple((name, LEVELS[name][k]) for name, k in zip(names, row, strict=True)))
        for number, row in enumerate(rows)
    ]
    # Of the papers' methods in their working range every extreme with every material, the rest at random.
    for method, material, extreme in itertools.product(LEVELS["method"][:2], LEVELS["material"][:3], LEVELS["extreme"]):
        row = {name: LEVELS[name][random.integers(len(LEVELS[name]))] for name in names}
        row |= {"method": method, "material": material, "extreme": extreme, "support": None, "jitter": 0.0}
        if random.integers(2) and method[0] == "tsph":
            row |= {
                "support": 1.5,
                "jitter": 0.2,
                "fraction": min(row["fraction"], 0.5),
                "poisson": max(row["poisson"], 0.0),
            }
        found.append(Case(len(found), tuple(row.items())))
    return found


_UNITS = {"1 m": (1.0, 1.0, 1.0), "nm": (1e-9, 1e-9, 1e-24), "km": (1e3, 1e3, 1e12), "years": (1.0, 3.2e7, 1.0)}
"""Length, time and mass of what is 1 in the scene."""


def scene(case: Case, precision: str, courant: float, seconds: float) -> wsph.Scene:
    """The scene of a case at a Courant number, to an end [s]."""
    dim, (integrator, formulation), extreme = case["dim"], case["method"], case["extreme"]
    length, time, mass = _UNITS[case["size"]]
    stress, density = mass / (length * time**2), mass / length**3
    cells = {1: 40, 2: 10, 3: 5}[dim] if extreme != "few cells" else 3
    origin = 1e6 if extreme == "far from the origin" else 0.0
    low, high = [origin * length] * dim, [(origin + 1.0) * length] * dim
    shape: dict[str, Any] = {"type": "box", "min": low, "max": high}
    spacing: Any = length / cells
    if extreme == "thin cells" and dim > 1:
        shape["max"] = [*high[:-1], low[-1] + 1e-6 * length * cells]
        spacing = [length / cells] * (dim - 1) + [1e-6 * length]
    if extreme == "turned by 1000 rad" and dim > 1:
        shape["rotate"] = np.degrees(1e3) % 360.0 if dim == 2 else [[0.0, 0.0, 1.0], np.degrees(1e3) % 360.0]
    material: dict[str, Any] = {"model": case["material"], "density": density, "youngs_modulus": stress, "poisson_ratio": case["poisson"]}  # fmt: skip
    harden = -0.02 * stress if extreme == "softening" else 0.1 * stress
    if case["material"] == "perzyna":
        material |= {
            "yield_stress": 1e-3 * stress,
            "hardening_modulus": harden,
            "fluidity": 1e-3 / time,
            "exponent": 1.0,
        }
    if case["material"] == "mises":
        material |= {"yield_stress": 1e-3 * stress, "hardening_modulus": harden}
    # A stretch of 2 within the run, or motion well within small strain.
    rate = float(1.0 / seconds) if extreme == "stretch 2" else 2e-3 / time
    x = f"(x - {low[0]!r})*{rate!r}"
    body = {"name": "body", "shape": shape, "spacing": spacing, "velocity": [x] + [0.0] * (dim - 1), "material": material, "jitter": case["jitter"]}  # fmt: skip
    if dim < 3:
        body["state"] = "strain"
    if integrator in ("rkc", "euler", "rk2", "pc2"):  # which undamped waves make grow
        body["viscosity"] = {"alpha": 1.0, "kind": "pair"}
    bodies, boundary = [body], []
    if "rotate" not in shape:
        boundary.append({"body": "body", "face": "-x", "fixed": ["x"]})
    if extreme == "light and stiff neighbour":
        far = {**shape, "min": [low[0] + 5.0 * length, *low[1:]], "max": [high[0] + 5.0 * length, *high[1:]]}
        bodies.append({**body, "name": "neighbour", "shape": far, "velocity": [0.0] * dim,
                       "material": {**material, "density": 1e-3 * density, "youngs_modulus": 1e-9 * stress}})  # fmt: skip
    run: dict[str, Any] = {"integrator": integrator, "formulation": formulation, "end": seconds, "cfl": courant, "precision": precision}  # fmt: skip
    if case["support"]:
        sets = 2 if integrator in ("tsph", "ul-tsph") else 1
        traits = next(each.traits for each in FORMULATIONS if (each.name, each.sets) == (formulation, sets))
        run["support"] = min(case["support"] * traits.support, traits.supports[1])
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=bodies, boundary=boundary)


@dataclass
class Verdict:
    """What became of a case in one precision: completed, warned of, refused or stopped; or the fault of a silent failure."""

    outcome: str
    reason: str = ""
    fault: str = ""
    velocity: np.ndarray | None = None
    shortest: float = 0.0
    """The shortest time step [s], where it followed the deformation."""
    warned: str = ""
    """What a run that completed was warned of."""


def verdict(case: Case, precision: str, dt: float = 0.0) -> Verdict:
    """Run a case, at a Courant number measured in double precision, or with a time step [s]."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            still = compose(scene(case, "f64", 1e-3, _UNITS[case["size"]][1]).with_(guard="off"))
            limits = [run.limit for run in still.bodies]
            known = [limit for limit in limits if limit is not None and np.isfinite(limit)]
            courant = case["fraction"] * (min(known) if known else 1.0)
            if courant == 0.0:
                return Verdict("refused", f"stability limit 0: {still.bodies[0].limit_reason}")
            seconds = STEPS * courant / 1e-3 * still.dt
            made = scene(case, precision, courant, seconds)
            result = wsph.run(made.with_(dt=dt) if dt > 0.0 else made, throw=False)
        except WsphError as error:
            return Verdict("refused", _first(str(error)))
    if not result.stable:
        return Verdict("stopped", _first(result.reason))
    velocity, energy = result.particles["velocity"], result.summary["energy"]
    if not all(
        np.isfinite(v).all() for name, v in result.particles.items() if v.dtype.kind == "f" and name != "density"
    ):
        return Verdict("completed", fault="a field is not finite")
    work, left = result.history["external_work"], result.history["residual"]
    largest = max(np.abs(work).max(), np.abs(work - left).max())
    warned = [_first(str(w.message)) for w in said if any(words in str(w.message) for words in WARNINGS)]
    for text in warned:
        if "digits" not in text:
            return Verdict("warned", text, velocity=velocity)
    if -energy["residual"] > CREATED * largest:
        return Verdict("completed", fault=f"{-100 * energy['residual'] / largest:.3g} % of energy created")
    steps = result.history["dt"]
    shortest = float(steps[-1]) if steps[-1] < steps[0] else 0.0
    return Verdict("completed", velocity=velocity, shortest=shortest, warned=" ".join(warned))


def _first(text: str) -> str:
    return text.splitlines()[0]


def outcomes(case: Case) -> dict[str, Verdict]:
    """Both precisions of a case; single beside double where both completed."""
    found = {precision: verdict(case, precision) for precision in ("f64", "f32")}
    if any(v.outcome != "completed" for v in found.values()):
        return found
    double, single = found["f64"].velocity, found["f32"].velocity
    followed = [v.shortest for v in found.values() if v.shortest > 0.0]
    if followed:
        # Where the time step followed the deformation they end up to a step apart: compared at the shortest of both.
        double, single = (verdict(case, precision, min(followed)).velocity for precision in found)
    if double is not None and single is not None and np.abs(double).max() > 0.0:
        gap = float(np.abs(single - double).max() / np.abs(double).max())
        if gap > APART and found["f32"].warned:
            found["f32"] = Verdict("warned", found["f32"].warned)
        elif gap > APART:
            found["f32"].fault = f"velocities {gap:.2g} off those in double precision"
    return found


WARNINGS = ("energy was created", "digits are left", "clump together")
"""Of what says that a result is not to be trusted."""

REASONS = {
    "digits are left": "single precision for a nearly incompressible material, warned of before it starts",
    "clump together": "the tensile instability of an updated kernel, warned of when it has grown",
    "too few neighbours": "a support too small for a gradient, named",
    "see too few": "a support too small for a gradient, named",
    "second moment": "jitter or a support for which no step is stable, named",
    "stability limit": "the limit follows the deformation: a run that falls below its step is stopped",
    "a mode of its step grows": "jitter on which collocation grows, measured before the run",
    "needs a rate": "a total law alone in a form of rates",
    "total law alone": "a total law alone in a form of rates",
    "as wide in every direction": "the form's own lattice",
    "needs a regular lattice": "the form's own lattice",
    "energy was created": "the energy stop",
    "inside out": "a particle turned over: the state is no answer any more",
    "is not finite": "the finite check",
    "time step of": "the law's own longest step, named",
    "no cell": "a body without a cell",
    "too far out": "numbers beyond double precision",
    "takes total laws": "a method without what the scene has, named",
    "undamped": "a method that amplifies, named",
    "processed": "a method without what the scene has, named",
    "velocity-independent": "a method without what the scene has, named",
}
"""Refusals that have been looked at: a part of the message, and why it is right."""


def in_working_range(case: Case) -> bool:
    """Where the papers' methods and materials are never refused: lattices with the default support, of ul-tsph of more than
    three cells and up to stretches at which a rate of elasticity still has an energy; of tsph also jitter up to 0.2 with a
    support of 1.8, at up to half of the limit, of what does not widen when it is pulled."""
    method = case["method"][0]
    if method not in ("tsph", "ul-tsph") or case["material"] not in ("elastic", "jaumann", "perzyna"):
        return False
    if case["jitter"] == 0.0:
        return case["support"] is None and (method == "tsph" or case["extreme"] not in ("stretch 2", "few cells"))
    calm = case["jitter"] <= 0.2 and case["fraction"] <= 0.5 and case["poisson"] >= 0.0
    return method == "tsph" and case["support"] == 1.5 and calm


def reviewed(reason: str) -> str:
    """Why a refusal is right; empty where nobody has looked at it."""
    return next((why for part, why in REASONS.items() if part in reason), "")


def table(rows: list[tuple[Case, dict[str, Verdict]]]) -> Iterator[str]:
    """docs/benchmarks/extremes.md."""
    total = 2 * len(rows)
    completed = sum(v.outcome == "completed" and not v.fault for _, found in rows for v in found.values())
    silent = sum(bool(v.fault) for _, found in rows for v in found.values())
    yield "# The extremes"
    yield ""
    yield "Generated by `python tests/extremes/grid.py`: a pairwise grid, every case 200 steps in double and in single precision."
    yield f"{total} runs: {completed} completed within bounds ({100 * completed / total:.0f} %), {total - completed - silent} refused, warned of or stopped by name,"
    yield f"{silent} silent failures."
    yield ""
    inside = [found for case, found in rows if in_working_range(case)]
    held, turned = (
        sum(v.outcome in outcomes for found in inside for v in found.values())
        for outcomes in (("completed",), ("refused", "stopped"))
    )
    yield "The working range of `tsph` and `ul-tsph` with `elastic`, `jaumann` and `perzyna`: lattices with the default support at any"
    yield "Courant number up to the limit, every size and extreme of the grid but, with `ul-tsph`, bodies of three cells and a"
    yield "stretch of 2, at which rates of elasticity have no energy; and with `tsph` jitter up to 0.2 with"
    yield "`support = 1.8`, a Poisson ratio from 0 and up to half of the limit."
    yield f"Of {2 * len(inside)} runs in it {turned} are refused or stopped; {held} completed within bounds, the others were warned of."
    yield ""
    yield "Bounds: finite, at most 2 % of energy created, single precision within 2 % of double."
    yield ""
    yield "| case | f64 | f32 | why it is right |"
    yield "| --- | --- | --- | --- |"
    for case, found in rows:
        cells = [f"**{v.fault}**" if v.fault else v.outcome for v in found.values()]
        why = "; ".join(dict.fromkeys(reviewed(v.reason) or f"**{v.reason}**" for v in found.values() if v.reason))
        yield f"| {case.number}. {case} | {cells[0]} | {cells[1]} | {why} |"


def main() -> int:
    """Run the grid, or one case of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", type=int, nargs="?")
    chosen = parser.parse_args().number
    rows = []
    for case in cases():
        if chosen in (None, case.number):
            rows.append((case, outcomes(case)))
            print(case.number, case, {p: (v.outcome, v.reason, v.fault) for p, v in rows[-1][1].items()}, flush=True)
    if chosen is None:
        path = Path(__file__).resolve().parents[2] / "docs" / "benchmarks" / "extremes.md"
        path.write_text("\n".join(table(rows)) + "\n")
    return int(any(v.fault for _, found in rows for v in found.values()))


if __name__ == "__main__":
    sys.exit(main())
