"""What every form is asked with every law in every stress state: small bodies, each with a stress that can be written down.

A check is a function of a `Row` that returns the largest error it found, over the largest right value; None where it says
nothing in that stress state.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import wsph
from tests import scenes
from tests.materials.closed_forms import (
    LAME,
    LAWS,
    NU,
    SHEAR,
    STIFF,
    elastic_line,
    plastic_line,
    sheared,
    thinned,
    total,
    total_line,
    viscous_line,
)
from wsph.geometry.shapes.shape import rotation_matrix
from wsph.output.fields import AXES, TENSOR

FORMS: dict[str, dict[str, Any]] = {
    "total-lagrangian along edges": {"integrator": "leapfrog", "formulation": "total-lagrangian"},
    "total-lagrangian with a kernel": {"integrator": "leapfrog", "formulation": "total-lagrangian", "support": 1.3},
    "stress-points": {"integrator": "leapfrog", "formulation": "stress-points"},
    "updated-lagrangian": {"integrator": "leapfrog", "formulation": "updated-lagrangian"},
    "tsph, small-strain": {"integrator": "tsph"},
    "ul-tsph, updated-lagrangian": {"integrator": "ul-tsph"},
}
STATES: list[tuple[int, str | None]] = [(1, "stress"), (1, "strain"), (2, "stress"), (2, "strain"), (3, None)]
TURN: dict[int, Any] = {2: 30.0, 3: [[1, 2, 3], 50.0]}


@dataclass(frozen=True)
class Row:
    """A form, a law and a stress state (`dim`, `state`)."""

    form: str
    law: str
    dim: int
    state: str | None

    def __str__(self) -> str:
        return f"{self.form}, {self.law}, {self.where}"

    @property
    def where(self) -> str:
        """The stress state in words."""
        return f"{self.dim}D" + (f", {'plane' if self.dim == 2 else 'uniaxial'} {self.state}" if self.state else "")

    @property
    def small(self) -> bool:
        """Whether nothing turns and no volume changes."""
        return self.form.startswith("tsph")

    @property
    def total(self) -> bool:
        """Whether the stress follows from the deformation."""
        return self.law == "neo-hookean" or (self.law == "elastic" and "formulation" in FORMS[self.form])

    @property
    def free(self) -> list[int]:
        """The directions across a pull along x that no stress acts along, where the sides of the body are free."""
        return [k for k in (1, 2) if k < self.dim or self.state == "stress"]


@dataclass(frozen=True)
class Check:
    """What a check is called in the table, the error allowed, the one allowed in rows that have their own (or None), and
    parts of what may be said of it: words about anything else excuse nothing."""

    words: str
    tolerance: float
    measure: Callable[[Row], float | None]
    own: Callable[[Row], float | None]
    said: tuple[str, ...]

    def allowed(self, row: Row) -> float:
        """The error allowed in a row."""
        return self.own(row) or self.tolerance

    def about(self, words: str) -> bool:
        """Whether words are about what this measures."""
        return any(part in words for part in (*self.said, TOTAL_ALONE))


CHECKS: dict[str, Check] = {}
TOTAL_ALONE = "has a total law alone"
KERNEL = "off beside held and loaded faces"
"""Of pairs of a kernel."""


def check(
    name: str, words: str, tolerance: float, *said: str, own: Callable[[Row], float | None] = lambda _: None
) -> Callable[[Callable[[Row], float | None]], None]:
    """Decorator: a check."""

    def add(measure: Callable[[Row], float | None]) -> None:
        CHECKS[name] = Check(words, tolerance, measure, own, said)

    return add


def result(row: Row, shape: dict[str, Any], law: dict[str, Any], end: float, cells: int = 4, *,
           body: dict[str, Any] | None = None, **tables: Any) -> wsph.Result:  # fmt: skip
    """The result of one body."""
    keys = {"state": row.state} if row.state else {}
    made = scenes.body(shape, 1.0 / cells, material=law, **keys, **(body or {}))
    run = {"end": end, "cfl": 0.4, "threads": 1, **FORMS[row.form]}
    output = {"fields": ["stress", "displacement", "velocity"], "history": 1}
    return wsph.run(scenes.scene(made, run=run, output=output, **tables))


def linear(direction: np.ndarray, strains: np.ndarray, origin: np.ndarray) -> list[str]:
    """Expressions of the velocity R diag(strains) R^T (x - origin), `direction` being R (dim, dim)."""
    gradient = direction @ np.diag(strains) @ direction.T
    return [
        " + ".join(f"({float(g)!r})*({b} - {float(at)!r})" for g, b, at in zip(line, AXES, origin, strict=False))
        for line in gradient
    ]


def patch(row: Row, *, turned: bool = False, jitter: float = 0.0) -> float:
    """A box that is held at one face, loaded at the opposite one and free at the others: one stress. The load grows with
    time and the velocity is linear; in the form whose gradients beside free faces are right at rest alone, where a stress
    of one value holds loads, the box is long and the load comes slowly. Turned, all of the velocity of the held face is
    zero: no strain across."""
    slowly = row.form == "updated-lagrangian"
    dim, pace, end, length = row.dim, 1e-6, *((60.0, 3.0) if slowly else (3.0, 1.0))
    poisson = 0.0 if turned else NU
    modulus = LAME + 2.0 * SHEAR if not row.free and not turned else 1.0
    across = -poisson
    if row.free == [1]:
        modulus, across = 1.0 / (1.0 - poisson**2), -poisson / (1.0 - poisson)
    R, origin, sides = np.eye(dim), np.zeros(dim), np.array([length, 1.0, 1.0])[:dim]
    shape = scenes.box(*sides.tolist())
    if turned:
        turn = TURN[dim]
        R = rotation_matrix((tuple(turn[0]), turn[1]) if dim == 3 else turn, dim)
        shape["rotate"], origin = turn, 0.5 * sides - 0.5 * length * R[:, 0]
    strains = pace * np.array([1.0, *(across if k in row.free else 0.0 for k in range(1, dim))])
    fixed = scenes.held("-x", dim) if turned else {"body": "b", "face": "-x", "fixed": ["x"]}
    rises, body = "t", {"velocity": linear(R, strains, origin), "jitter": jitter}
    if slowly:
        rises, body = "(1-cos(pi*min(t/20,1)))", {"damping": {"rate": 1.0}, "jitter": jitter}
    load = {"body": "b", "face": "+x", "stress": {"xx": f"{modulus * pace!r}*{rises}"}}
    law = LAWS[row.law] | {"poisson_ratio": poisson}
    found = result(row, shape, law, end, boundary=[fixed, load], body=body)
    pulled = modulus * pace * (2.0 if slowly else found.time)
    right = np.zeros((3, 3))
    right[:dim, :dim] = pulled * np.outer(R[:, 0], R[:, 0])
    for k in range(1, 3):
        if k not in row.free and not turned:
            right[k, k] = NU / (1.0 - NU) * right[0, 0] if not row.free else NU * right[0, 0]
    packed = np.array([right[AXES.index(a), AXES.index(b)] for a, b in TENSOR])
    stress = found.particles["stress"]
    return float(np.abs(stress - packed[: stress.shape[1]]).max() / pulled)


@check("patch", "patch", 1e-5, KERNEL)
def _(row: Row) -> float | None:
    return patch(row)


@check("turned", "patch, turned", 1e-5, KERNEL)
def _(row: Row) -> float | None:
    return patch(row, turned=True) if row.dim > 1 else None


@check("jittered", "patch, jittered", 1e-5, KERNEL, "off where a lattice is jittered")
def _(row: Row) -> float | None:
    return patch(row, jitter=0.2)


def moved(row: Row, law: dict[str, Any], speeds: list[str], end: float, **tables: Any) -> wsph.Result:
    """The result of a cube every particle of which is driven from where it began."""
    velocity = dict(zip(AXES, speeds, strict=False))
    drive = [{"body": "b", "where": "x > -1", "velocity": velocity}]
    body = {} if "functions" in tables else {"velocity": speeds}
    cube = scenes.cube(row.dim, centred=True)
    return result(row, cube, law, end, 3, body=body, boundary=drive, stop={"energy": 1e9}, **tables)


@check("turns", "turned under stress", 2e-2, "has turned or stretched beyond small strain")
def _(row: Row) -> float | None:
    """Stretched along x by 5 % and turned by a right angle: what was sigma_xx is sigma_yy."""
    if row.dim == 1:
        return None
    start, end = 2.0, 22.0
    angle = f"0.25*pi*(1-cos(pi*(t-{start})/{end - start}))*(t >= {start})"
    pace = f"(t >= {start})*0.25*pi*(pi/{end - start})*sin(pi*(t-{start})/{end - start})"
    stretch = f"(t < {start})*0.025*(pi/{start})*sin(pi*t/{start})"
    functions = {
        "vx": f"{stretch}*x + ({pace})*(-sin({angle})*1.05*x - cos({angle})*y)",
        "vy": f"({pace})*(cos({angle})*1.05*x - sin({angle})*y)",
        "vz": "0*t",
    }
    given = {name: {"expression": text} for name, text in list(functions.items())[: row.dim]}
    stress = moved(row, STIFF[row.law], list(given), end, functions=given).particles["stress"]
    free = [2] if row.state == "stress" else []
    along, across, out = total_line(row.law, free, 1.05) if row.total else elastic_line(free, 1.05)[0]
    right = np.array([across, along, out, 0.0, 0.0, 0.0])[: stress.shape[1]]
    return float(np.abs(stress - right).max() / along)


@check("tension", "pulled beyond yield", 1e-2, KERNEL)
def _(row: Row) -> float | None:
    """A bar whose end is drawn slowly to 1 %, five times the strain at yield; its sides are free."""
    pace, end = 1e-4, 100.0
    poisson = NU if row.free != [1] else NU / (1.0 - NU)
    strains = pace * np.array([1.0, *(-poisson for _ in range(1, row.dim))])
    boundary = [{"body": "b", "face": "-x", "fixed": ["x"]}, scenes.driven("+x", x=pace)]
    body = {"velocity": linear(np.eye(row.dim), strains, np.zeros(row.dim)), "damping": {"rate": 0.05}}
    box = scenes.box(*[1.0, (-0.25, 0.25), (-0.25, 0.25)][: row.dim])
    found = result(row, box, LAWS[row.law], end, boundary=boundary, body=body)
    stretch = 1.0 + pace * found.time
    if row.total:
        right = total_line(row.law, row.free, stretch)
    elif row.law == "perzyna":
        right = viscous_line(row.free, stretch, row.small, speed=pace)[0]
    else:
        right = (plastic_line if row.law == "mises" else elastic_line)(row.free, stretch, row.small)[0]
    return float(np.abs(found.particles["stress"][:, :3] - right).max() / np.abs(right).max())


@check("shear", "sheared to 3", 5e-3, "has no thickness without stress")
def _(row: Row) -> float | None:
    """Far from yield: Jaumann's rate in its own closed form, where the law turns itself; else that of axes that turn with
    the material."""
    if row.dim == 1:
        return None
    swings = row.law in ("jaumann", "mises")
    found = moved(row, STIFF[row.law], ["0.1*y", "0", "0"][: row.dim], 30.0)
    shear = 0.1 * found.time
    if row.total:
        F = np.eye(3)
        F[0, 1] = shear
        exact = total(row.law, thinned(row.law, F) if row.state == "stress" else F)
        right = np.array([exact[0, 0], exact[1, 1], exact[2, 2], exact[0, 1], 0.0, 0.0])
    elif row.small and not swings:
        right = np.array([0.0, 0.0, 0.0, SHEAR * shear, 0.0, 0.0])
    else:
        normal, along = sheared("jaumann" if swings else row.law, shear)
        right = np.array([normal, -normal, 0.0, along, 0.0, 0.0])
    stress = found.particles["stress"]
    if row.form == "updated-lagrangian":
        # Corners of the form whose pairs follow lose their neighbours on the way.
        place = found.particles["position"]
        stress = stress[[np.abs(place - place.mean(0)).sum(1).argmin()]]
    return float(np.abs(stress - right[: stress.shape[1]]).max() / np.abs(right).max())


CUT, BLOCKS = 4e-2, 5e-2
"""Errors at rest of the order of the spacing: of a kernel that is cut at the free face, where two layers are off, and of one
pressure for two spacings, which is off by the weight of half a spacing."""


def at_rest(row: Row) -> float | None:
    """The error allowed at rest where it is one of the order of the spacing."""
    if row.form == "updated-lagrangian":
        return CUT
    flows = row.law in ("perzyna", "mises") and (row.dim, row.state) in ((2, "strain"), (3, None))
    return BLOCKS if flows and row.form == "total-lagrangian along edges" else None


@check("rest", "rest under gravity", 1e-2, KERNEL, own=at_rest)
def _(row: Row) -> float | None:
    """A cube on a floor, between walls on which it slides: the stress inside, the velocities that are left, and how far
    the ledger is from closed and goes on."""
    weight, end = 1e-5, 30.0
    walls = [{"body": "b", "face": sign + a, "fixed": [a]} for a in AXES[1 : row.dim] for sign in "-+"]
    boundary = [{"body": "b", "face": "-x", "fixed": ["x"]}, *walls]
    found = result(row, scenes.cube(row.dim), LAWS[row.law], end, 8, boundary=boundary,
                   gravity={"x": -weight}, body={"damping": {"rate": 2.0}})  # fmt: skip
    x, history = found.particles["position"][:, 0], found.history
    inside = (x > 0.25) & (x < 0.75)
    stress = np.abs(found.particles["stress"][inside, 0] / weight - (x[inside] - 1.0)).max()
    work, late = np.abs(history["external_work"]).max(), history["time"] > 0.7 * end
    goes_on = max(np.ptp(history[name][late]) for name in ("external_work", "residual", "kinetic"))
    return float(max(stress, goes_on / work, abs(history["residual"][-1]) / work))
