"""Scenes that processes share, and what all of them come to, by the number of the processes: run by mpiexec.

    mpiexec -n 4 python -m tests.ranks.shared_cases [--every] CASE...

Prints for every case a line of JSON: digests of all that a run gives, by the numbers of processes in words.
"""

from typing import Any

import wsph
from tests import scenes
from tests.ranks.case_runs import begin

STEPS = 12


def scene(dim: int = 2, form: str = "stress-points", law: str = "elastic", **changes: object) -> wsph.Scene:
    """A body of some thousand particles that is bent and pulled across all cuts, with records of every kind. `more`: bodies
    beside it, as name, corners and what differs; `probed`: more probes."""
    far = {1: [5000.0], 2: [90.0, 50.0], 3: [24.0, 15.0, 15.0]}[dim]
    run = {"integrator": "leapfrog", "formulation": form, "end": 0.2 * STEPS, "dt": 0.2, **changes.pop("run", {})}  # type: ignore[dict-item]
    flat = {"state": "stress" if dim == 1 else "strain"} if dim < 3 else {}
    body = {
        "name": "b",
        "shape": {"type": "box", "min": [0.0] * dim, "max": far},
        "spacing": 1.0,
        "velocity": ["1e-3*y", "1e-3*x", "1e-3*sin(x)"][:dim] if dim > 1 else ["1e-4*x"],
        "material": scenes.material(law, **changes.pop("material", {})),  # type: ignore[arg-type]
        **flat,
        **changes.pop("body", {}),  # type: ignore[dict-item]
    }
    bodies = [body]
    for name, low, high, differs in changes.pop("more", []):  # type: ignore[attr-defined]
        bodies.append({**body, "name": name, "shape": {"type": "box", "min": low, "max": high}, **differs})
    boundary = [
        {"name": "root", "body": "b", "where": "x < 0.6", "fixed": list("xyz"[:dim])},
        {"name": "end", "body": "b", "face": "+x", "traction": {"x": "1e-3*min(t, 1)"}},
        *changes.pop("boundary", []),  # type: ignore[misc]
    ]
    fields = ["velocity", "stress", "displacement", *changes.pop("fields", [])]  # type: ignore[misc]
    middle = [0.5 * far[0] + 0.3, *(0.2 * each for each in far[1:])]
    probes = [
        {"name": "middle", "at": [middle], "fields": ["velocity", "stress"], "every": 1},
        {"name": "tip", "where": f"x > {far[0] - 0.6}", "fields": ["velocity"], "reduce": "mean", "every": 3},
        {"name": "force", "of": "root", "fields": ["force", "work"], "every": 4},
        *changes.pop("probed", []),  # type: ignore[misc]
    ]
    output = {"every": STEPS // 2, "history": 3, "fields": fields, "formats": []}
    tables = {"boundary": boundary, "probes": probes, "output": output, **changes}
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=bodies, **tables)


MISES = {"law": "mises", "material": {"yield_stress": 1e-3}}
PERZYNA = {
    "law": "perzyna",
    "material": {"yield_stress": 1e-4, "hardening_modulus": 0.1, "fluidity": 1e-4, "exponent": 1.0},
}
SIDES = [
    {"body": "b", "face": "+y", "traction": {"y": 1e-3}},
    {"body": "b", "face": "-y", "displacement": {"x": "1e-3*t*t"}},
]
HOLE = {
    "shape": {
        "type": "difference",
        "shapes": [
            {"type": "box", "min": [0.0, 0.0], "max": [100.0, 60.0]},
            {"type": "disc", "name": "hole", "center": [50.0, 30.0], "radius": 14.0},
        ],
    },
    "surface": "stairs",
}
ON_FACES = [
    {"name": "slide", "body": "b", "face": "-y", "normal": 0.0},
    {"name": "hole", "body": "b", "patch": "hole", "pressure": "1e-3*min(t, 1)"},
    {"name": "held", "body": "b", "face": "+y", "spring": {"stiffness": 0.02, "damping": {"normal": 0.1}}},
]
WEIGHT = [{"where": "y > 20", "y": "-1e-5*min(t, 1)"}, {"x": "1e-6*y"}]
CUT = {"name": "cut", "body": "b", "point": [50.0, 0.0], "normal": [1.0, 0.2]}
WHOLE_FORCE = {"name": "pull", "body": "b", "face": "+x", "force": {"y": "0.02*min(t, 1)"}}
PERIODIC = {"body": "b", "face": "-y", "periodic": "+y"}
QUIET = {"name": "out", "body": "b", "face": "+z", "quiet": True}
CRACKS = [{"from": [20.0, 25.0], "to": [70.0, 25.0]}, {"from": [45.0, 30.0], "to": [45.0, 50.0]}]
TORN = {"velocity": [0.0, "0.02*tanh(y - 25.5)*(1 + 0.3*sin(x))"]}
"""A motion that tears a body along all of its length."""
CRACKING = {"fracture_energy": 2e-4, "length": 3.0}
PRESSED = [
    {"body": "b", "face": "+x", "force": {"y": 0.02}},
    {"body": "b", "face": "+y", "pressure": "1e-4*(1 + x)", "spring": {"stiffness": 1e-3}},
]
VISCOUS = {"viscosity": {"alpha": 0.1, "beta": 0.2}, "damping": {"rate": 0.01}}

ROUND = {"shape": {"type": "disc", "center": [35.0, 132.3], "radius": 6.0}, "velocity": ["0.0", "-0.5"]}
BESIDE = [
    ("c", [0.0, 60.0], [70.0, 126.0], {}),
    ("s", [-60.0, 0.0], [-10.0, 50.0], VISCOUS),
    ("f", [], [], ROUND),
]
"""A second body that is cut, one that is too small for four processes, and one whose surface is fitted, which runs into the
second."""

OF_BESIDE = {
    "more": BESIDE,
    "boundary": [
        {"name": "pull", "body": "s", "face": "+x", "traction": {"x": 1e-3}},
        {"name": "press", "body": "f", "where": "x < 35", "pressure": 1e-3},
    ],
    "probed": [
        {"name": "pull", "of": "pull", "fields": ["force", "work"], "every": 4},
        {"name": "press", "of": "press", "fields": ["force", "work"], "every": 1},
        {
            "name": "in-s",
            "body": "s",
            "where": "x < -51",
            "fields": ["velocity", "stress"],
            "reduce": "max",
            "every": 3,
        },
        {"name": "in-c", "at": [[30.3, 80.2]], "fields": ["velocity"], "every": 1},
    ],
}
WITHOUT_PRESSURE = {key: [each for each in OF_BESIDE[key] if each["name"] != "press"] for key in ("boundary", "probed")}  # type: ignore[index, attr-defined]


OF_LAW = {"surface": {"friction": 0.3}, "tie": {"strength": 0.2}}
"""Of contacts of a law: ties break somewhere."""

SLIT = {
    "shape": {
        "type": "difference",
        "shapes": [
            {"type": "box", "min": [0.0, 0.0], "max": [90.0, 50.0]},
            {"type": "box", "min": [20.0, 25.0], "max": [91.0, 26.0]},
        ],
    },
    "velocity": ["0.05*y", "-0.4*tanh(y - 25.5)"],
}
"""A slit along most of a body, whose sides come together and slide on each other."""


def meeting(dim: int = 2, *, between: str = "surface", **changes: object) -> wsph.Scene:
    """A body that comes down on another one, all along the cuts, and slides on it; on top of it a small body and, in 2D, a
    tool that is pressed into it and one that is free."""
    gap, y = (0.0 if between == "tie" else 0.01), (50.0 if dim == 2 else 15.0)
    if dim == 2:
        low, high = [3.3, y + gap], [73.3, y + gap + 66.0]
    else:
        low, high = [2.4, y + gap, -1.0], [22.4, y + gap + 15.0, 14.0]
    top = high[1] + gap
    small = [high[0] - 8.0, top, *(each - 8.0 for each in high[2:])], [high[0], top + 6.0, *high[2:]]
    differs = {"velocity": ["0.0", "-0.2", "0.0"][:dim]}
    tools = []
    if dim == 2:
        differs["shape"] = {"type": "disc", "center": [60.0, top + 5.0], "radius": 5.0}
        die = {"type": "disc", "center": [36.0, top + 8.1], "radius": 8.0}
        ball = {"type": "disc", "center": [12.0, top + 4.02], "radius": 4.0}
        tools = [
            {"name": "die", "shape": die, "velocity": {"y": "-0.3"}, "against": ["c"], "friction": 0.2},
            {"name": "ball", "shape": ball, "velocity": [0.1, -0.3], "mass": 50.0, "against": ["c", "die"]},
        ]
    touch = {"name": "touch", "between": ["b", "c"], "law": between}
    of = ("touch", "top", *(each["name"] for each in tools))
    return scene(
        dim,
        more=[("c", low, high, {"velocity": ["2e-3*y", "-0.1", "0.0"][:dim]}), ("s", *small, differs)],
        contact=[touch | OF_LAW.get(between, {}), {"name": "top", "between": ["c", "s"]}],
        tools=tools,
        fields=["contact_pressure", "contact_gap"],
        probed=[{"name": f"of-{name}", "of": name, "fields": ["force", "work"], "every": 1} for name in of],
        **changes,
    )


def cornered(**changes: object) -> wsph.Scene:
    """A body that comes into the corner between two others: there a vertex is pushed by both, and pushes both."""
    probes = [{"name": name, "of": name, "fields": ["force", "work"], "every": 1} for name in ("one", "two")]
    return scene(
        more=[
            ("d", [90.05, 0.0], [150.05, 90.0], {}),
            ("c", [20.04, 50.01], [90.04, 116.01], {"velocity": [0.1, -0.2]}),
        ],
        contact=[
            {"name": "one", "between": ["b", "c"], "friction": 0.3},
            {"name": "two", "between": ["d", "c"], "friction": 0.3},
        ],
        **changes,
    ).with_(probes=probes)


def going_round(dim: int, **changes: object) -> wsph.Scene:
    """A body that closes on itself across the cuts, and in 3D along them too."""
    wave = {"velocity": ["0.02*sin(x)", "0.01*exp(-0.1*x)", "0.01*cos(y)"][:dim]}
    body = wave | changes.pop("body", {})  # type: ignore[operator]
    entries = [
        {"body": "b", "face": "-x", "periodic": "+x"},
        {"body": "b", "face": "-y", "fixed": ["y"]},
        {"body": "b", "face": "+y", "traction": {"x": "1e-3*min(t, 1)"}},
    ]
    if dim == 3:
        entries[1:] = [{"body": "b", "face": f"-{axis}", "periodic": f"+{axis}"} for axis in "yz"]
    probes = [{"name": "end", "where": "x < 0.6", "fields": ["velocity", "stress"], "reduce": "max", "every": 1}]
    return scene(dim, body=body, **changes).with_(boundary=entries, probes=probes)


UPDATED = "updated-lagrangian"
SWAYING = {"velocity": ["0.25*sin(0.2*y)", "0.25*sin(0.15*x)"]}
"""A motion in which particles leave their skins several times."""
DRIVEN = [
    {"name": "lid", "body": "b", "face": "+y", "velocity": {"y": "-0.2*t", "x": 0.05}},
    {"name": "floor", "body": "b", "face": "-y", "displacement": {"y": "0.02*t*t"}},
]


def distorted(far: tuple[float, float], velocity: str, *, at: str = "cells", **changes: object) -> wsph.Scene:
    """A body of particles `at` cells or nodes, distorted until parts that are not next to each other are neighbours."""
    shape = {"type": "box", "min": [0.0, 0.0], "max": list(far)}
    probes = [
        {
            "name": "middle",
            "at": [[0.5 * far[0] + 0.1, 0.5 * far[1] + 0.3]],
            "fields": ["velocity", "stress"],
            "every": 1,
        },
        {"name": "low", "where": "y < 60 and x < 50", "fields": ["stress"], "reduce": "max", "every": 2},
    ]
    given: dict[str, Any] = {
        "body": {"shape": shape, "velocity": [velocity, "0.0"], "placement": at},
        "run": {"dt": 0.05, "end": 2.4, "guard": "off"},
        "stop": {"energy": 1e300},
        "output": {"every": 24, "history": 12, "fields": ["velocity", "stress", "displacement"], "formats": []},
    }
    made = scene(form=UPDATED, probes=probes, **given | {**MISES, **changes})
    return made.with_(boundary=[{"name": "end", "body": "b", "face": "+y", "traction": {"y": 1e-4}}])


WAITING: dict[str, Any] = {
    "steps": [
        {"name": "one", "duration": 2.0},
        {"name": "two", "duration": 0.4, "relax": {"until": 0.5, "max_steps": 5000}},
    ],
    "law": "elastic",
    "material": {},
    "run": {"dt": 0.05, "end": None, "guard": "off"},
}
"""Brought to rest in the middle of a run: what has been distorted goes back."""


RESTED: dict[str, Any] = {
    "body": {"body_force": [{"where": "y > 20", "y": "-1e-5"}]},
    "more": [("c", [3.3, 50.0], [73.3, 116.0], {}), ("s", [-60.0, 0.0], [-10.0, 50.0], {})],
    "boundary": [
        {"body": "b", "face": "+x", "force": {"y": 0.02}},
        {"body": "c", "where": "x > 72.7", "fixed": ["x", "y"]},
        {"body": "c", "face": "+y", "pressure": "1e-4*(1 + x)", "spring": {"stiffness": 1e-3}},
        {"body": "s", "where": "x < -59.4", "fixed": ["x", "y"]},
        {"body": "s", "face": "+x", "traction": {"x": 1e-3}},
    ],
    "relax": {"until": 0.7, "max_steps": 5000},
    "run": {"dt": 0.3},
    "checkpoint": {"every": 40},
    "sections": [
        {"name": "cut", "body": "b", "point": [50.0, 0.0], "normal": [1.0, 0.2]},
        {"name": "across", "body": "c", "point": [40.0, 80.0], "normal": [0.0, 1.0]},
        {"name": "small", "body": "s", "point": [-30.0, 0.0], "normal": [1.0, 0.0]},
    ],
    "probed": [{"name": "of-across", "of": "across", "fields": ["force", "torque"], "every": 4}],
}
"""Bodies that come to rest together, of which one is too small to be cut, and sections of all."""
PUSHED = {"body": "c", "face": "+y", "traction": {"y": -2e-3}}
DIE = {
    "name": "die",
    "shape": {"type": "disc", "center": [36.0, 124.1], "radius": 8.0},
    "velocity": {"y": "-0.3"},
    "against": ["c"],
}


def balls(form: str = "total-lagrangian", **changes: object) -> wsph.Scene:
    """Bodies of balls that meet all along the cuts: a body, one that is cut too, and a small one that comes down on that."""
    return scene(
        form=form,
        more=[
            ("c", [0.4, 50.0], [70.4, 115.0], {"velocity": ["2e-3*y", "-0.1"]}),
            ("s", [30.2, 115.0], [36.2, 119.0], {"velocity": [0.05, -0.3]}),
        ],
        contact=[
            {"name": "touch", "between": ["b", "c"], "law": "pinball", "friction": 0.2},
            {"name": "top", "between": ["c", "s"], "law": "pinball"},
            {"name": "itself", "self": "b", "law": "pinball"},
        ],
        **changes,
    )


def two_sets(dim: int = 2, law: str = "elastic", *, moves: bool = False, **changes: object) -> wsph.Scene:
    """A body of two sets of particles, those that follow the motion where it `moves`, that is held, driven and pulled at
    along all cuts."""
    how = {"integrator": "ul-tsph" if moves else "tsph", "dt": 0.4, "end": 0.4 * STEPS}
    given: dict[str, object] = {"body": {}, "run": {}, **changes}
    low = [{"body": "b", "face": "-y", "symmetry": "y"}] if dim > 1 else []
    at_end = "x > 70 and y > 49.5" if dim == 2 else "x > 20 and y > 14.5"
    driven = [{"body": "b", "where": at_end, "displacement": {"y": "-1e-3*t*t"}}] if dim > 1 else []
    entries = [
        {"name": "root", "body": "b", "face": "-x", "fixed": list("xyz"[:dim])},
        {"name": "end", "body": "b", "face": "+x", "stress": {"xx": "1e-3*min(t, 1)"}},
        *changes.pop("boundary", [*low, *driven]),  # type: ignore[misc]
    ]
    body = {"velocity": ["1e-3*sin(0.2*y)", "1e-3*x", "1e-3*sin(x)"][:dim] if dim > 1 else ["1e-4*x"], **given["body"]}  # type: ignore[dict-item]
    made = scene(dim, None, law, **changes | {"body": body, "run": how | given["run"]})  # type: ignore[operator]
    return made.with_(boundary=entries, probes=[each for each in made.data()["probes"] if "of" not in each])


CASES = {
    "viscous": lambda: scene(body=VISCOUS, gravity={"y": -1e-4}, run={"dt": None, "cfl": "auto"}),
    "plastic": lambda: scene(3, **MISES, run={"precision": "f32"}),
    "rubber": lambda: scene(law="neo-hookean", body=HOLE, run={"integrator": "rk4"}),
    "bar": lambda: scene(1, run={"integrator": "w20-2-8"}),
    "edges": lambda: scene(form="total-lagrangian", run={"integrator": "blanes-moan4"}),
    "edges viscous": lambda: scene(form="total-lagrangian", body={"viscosity": {"alpha": 0.1}}, boundary=SIDES),
    "kernel": lambda: scene(
        form="total-lagrangian",
        body={"viscosity": {"alpha": 0.5}},
        run={"support": 2.6, "integrator": "rkc", "precision": "f32", "dt": None, "cfl": 0.3},
    ),
    "on faces": lambda: scene(
        body={**HOLE, "initial": {"stress": {"xx": "1e-5*x", "xy": 1e-4}}}, boundary=ON_FACES, sections=[CUT]
    ),
    "inside": lambda: scene(
        form="total-lagrangian",
        law="jaumann",
        body={"body_force": WEIGHT, "initial": {"stress": {"yy": "1e-5*y"}}},
        boundary=[
            WHOLE_FORCE,
            ON_FACES[0],
            {"body": "b", "where": "x > 89.5 and y > 10", "displacement": {"x": "1e-3*t*t"}},
        ],
        sections=[CUT],
    ),
    "periodic": lambda: scene(3, boundary=[PERIODIC, QUIET], run={"precision": "f32"}),
    "round": lambda: going_round(2, body=VISCOUS, run={"dt": None, "cfl": "auto"}),
    "round in 3D": lambda: going_round(3, law="neo-hookean", run={"precision": "f32", "integrator": "rk4"}),
    "round along edges": lambda: going_round(2, form="total-lagrangian", body={"viscosity": {"alpha": 0.1}}),
    "relaxed": lambda: scene(
        body={"body_force": [{"where": "y > 20", "y": "-1e-5"}]},
        boundary=PRESSED,
        relax={"until": 0.7, "max_steps": 5000},
        run={"dt": 0.4},
        checkpoint={"every": 40},
    ),
    "relaxed bodies": lambda: scene(
        **RESTED, contact=[{"name": "touch", "between": ["b", "c"], "law": "surface"}], tools=[DIE]
    ),
    "relaxed balls": lambda: scene(
        form="total-lagrangian",
        **RESTED | {"boundary": [PUSHED if "pressure" in each else each for each in RESTED["boundary"]]},
        contact=[{"name": "touch", "between": ["b", "c"], "law": "pinball"}],
    ),
    "jittered edges": lambda: scene(form="total-lagrangian", body={"jitter": 0.1, "viscosity": {"alpha": 0.1}}),
    "cracked": lambda: scene(body={"cracks": CRACKS, "jitter": 0.1}, boundary=[*SIDES, WHOLE_FORCE]),
    "cracked kernel": lambda: scene(form="total-lagrangian", body={"cracks": CRACKS}, run={"support": 2.6}),
    "mapped": lambda: scene(body={"map": ["x + 0.2*sin(0.3*y)", "y*(1 + 0.002*x)"]}, boundary=ON_FACES[2:]),
    "breaking": lambda: scene(body={"phase_field": CRACKING, "cracks": CRACKS[:1], **TORN}),
    "breaking kernel": lambda: scene(
        form="total-lagrangian", law="jaumann", body={"phase_field": CRACKING | {"model": "AT2"}, **TORN}
    ),
    "breaking points": lambda: scene(body={"phase_field": CRACKING, **TORN}, run={"support": 1.8}),
    "breaking jitter": lambda: scene(body={"phase_field": CRACKING, "jitter": 0.1, **TORN}),
    "breaking map": lambda: scene(
        body={"phase_field": CRACKING, "map": ["x + 0.2*sin(0.3*y)", "y*(1 + 0.002*x)"], **TORN}
    ),
    "links": lambda: scene(
        form="total-lagrangian", law="jaumann", body={"links": {"criterion": "stretch", "threshold": 0.012}, **TORN}
    ),
    "sides": lambda: scene(law="jaumann", boundary=SIDES, run={"integrator": "kg4-8"}),
    "bodies": lambda: scene(**OF_BESIDE, gravity={"y": -1e-4}),
    "contact": lambda: meeting(),
    "contact of two": lambda: cornered(form="total-lagrangian", run={"precision": "f32"}),
    "contact 3D": lambda: meeting(3, **MISES, run={"precision": "f32", "dt": None, "cfl": "auto"}),
    "contact with itself": lambda: scene(
        body=SLIT,
        contact=[{"name": "itself", "self": "b", "friction": 0.3}],
        fields=["contact_pressure", "contact_gap"],
        probed=[{"name": "of-itself", "of": "itself", "fields": ["work"], "every": 1}],
    ),
    "balls": lambda: balls(),
    "balls of links": lambda: balls(
        law="jaumann", body={"links": {"criterion": "stretch", "threshold": 0.012}, "velocity": TORN["velocity"]}
    ),
    "tie": lambda: meeting(between="tie", form="total-lagrangian", run={"integrator": "rk4"}),
    "updated": lambda: scene(form=UPDATED, body=VISCOUS | SWAYING, gravity={"y": -1e-3}),
    "updated plastic": lambda: scene(
        3,
        form=UPDATED,
        **MISES,
        body={"velocity": ["0.2*sin(0.5*y)", "0.2*sin(0.5*z)", "0.2*sin(0.5*x)"]},
        run={"precision": "f32"},
    ),
    "updated walls": lambda: scene(
        form=UPDATED,
        law="neo-hookean",
        body=SWAYING | {"body_force": WEIGHT, "initial": {"stress": {"yy": "1e-4*y"}}},
        boundary=DRIVEN,
        sections=[CUT],
        run={"integrator": "rk4"},
    ),
    "updated cracked": lambda: scene(
        form=UPDATED,
        body={"cracks": CRACKS, "artificial_stress": {}, **SWAYING},
        boundary=[WHOLE_FORCE],
        run={"dt": None, "cfl": "auto"},
    ),
    "updated bar": lambda: scene(1, form=UPDATED, law="jaumann", body={"velocity": ["0.2*sin(0.01*x)"]}),
    "updated sheared": lambda: distorted((20.0, 250.0), "y - 125"),
    "updated pressed": lambda: distorted((140.0, 30.0), "0.3*(70 - x)"),
    "updated heaped": lambda: distorted((140.0, 30.0), "0.15*(abs(x - 70) - (x - 70))", at="nodes"),
    "updated waiting": lambda: distorted((140.0, 30.0), "0.1*(70 - x)", **WAITING),
    "updated contact": lambda: meeting(form=UPDATED, body=SWAYING),
    "updated balls": lambda: balls(form=UPDATED, body=SWAYING),
    "updated nodes": lambda: scene(
        form=UPDATED,
        law="jaumann",
        body=SWAYING | {"placement": "nodes"},
        boundary=PRESSED,
        run={"integrator": "w20-2-8"},
    ),
    "updated bodies": lambda: scene(form=UPDATED, **OF_BESIDE | {"body": SWAYING, **WITHOUT_PRESSURE}),
    "updated relaxed": lambda: scene(
        form=UPDATED,
        boundary=[PRESSED[0] | {"force": {"y": 0.4}}],
        relax={"until": 0.9, "max_steps": 5000},
        run={"dt": 0.4},
    ),
    "two sets": lambda: two_sets(body={"body_force": WEIGHT, "damping": {"rate": 0.01}}, gravity={"y": -1e-4}),
    "two sets bar": lambda: two_sets(1, "jaumann", run={"dt": None, "cfl": "auto"}),
    "two sets jittered": lambda: two_sets(**PERZYNA, body={"jitter": 0.1}, boundary=[], run={"guard": "warn"}),
    "two sets cracked": lambda: two_sets(
        body={"cracks": CRACKS[:1], "shape": HOLE["shape"], "surface": "stairs"},
        boundary=[{"body": "b", "patch": "hole", "stress": {"xx": 1e-3, "yy": 1e-3}}],
    ),
    "two sets bodies": lambda: two_sets(more=[BESIDE[0], (*BESIDE[1][:3], {"damping": {"rate": 0.01}})]),
    "two sets moving": lambda: two_sets(
        moves=True,
        **MISES,
        body={"body_force": WEIGHT, **SWAYING},
        gravity={"y": -1e-4},
        run={"dt": 0.2, "end": 0.2 * STEPS},
    ),
    "two sets adapting": lambda: two_sets(moves=True, body=SWAYING, boundary=DRIVEN, run={"dt": None, "cfl": 0.8}),
    "two sets moving 3D": lambda: two_sets(3, moves=True, run={"precision": "f32", "support": 1.8}),
    "two sets moving bar": lambda: two_sets(1, moves=True, **PERZYNA),
    "two sets moving jittered": lambda: two_sets(moves=True, body={"jitter": 0.1, "cracks": CRACKS[:1]}, law="jaumann"),
    "two sets plastic": lambda: two_sets(3, **MISES, run={"precision": "f32"}),
}
"""Of every form, law, integrator, dimension and precision some, with what crosses the cuts."""


if __name__ == "__main__":
    begin(CASES)
