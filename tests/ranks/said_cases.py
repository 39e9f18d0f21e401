"""What is said of scenes before they run, by one process and by those that share them: one line of JSON a scene."""

import json
import warnings

from mpi4py import MPI

import wsph
from tests.ranks.shared_cases import two_sets
from tests.scenes import body, box, held, scene
from wsph.ranks.mpi import Ranks

RUN = {"formulation": "stress-points", "cfl": 0.2}
BALL = body(
    {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}, 0.05, surface="stairs", velocity=["50*x", 0.0, 0.0]
)
DISC = body({"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, 1.0 / 40.0, surface="stairs")
HOLE = {"type": "disc", "name": "hole", "center": [1.0, 0.525], "radius": 0.02}
PLATE = body({"type": "difference", "shapes": [box(4.0, 1.0), HOLE]}, 0.05, surface="stairs")
PULLED = {"body": "b", "where": "x > 0.5", "traction": {"y": 1e-3}}
ALL = {"body": "b", "where": "x > -1", "velocity": {"x": "x*t"}}

SCENES = [
    scene(BALL, run=RUN),
    scene(DISC, run=RUN, boundary=[PULLED]),
    scene(PLATE, run=RUN, boundary=[ALL]),
    scene(PLATE, run=RUN | {"end": 1e-3}, boundary=[held("-x", 2)]),
    two_sets(body={"jitter": 0.1}, run={"dt": 1.1, "guard": "warn"}, output={"every": 1}),
]

if __name__ == "__main__":
    warnings.simplefilter("ignore")
    for made in SCENES:
        said = wsph.compose(made, Ranks(MPI.COMM_WORLD)).said  # type: ignore[arg-type]
        if MPI.COMM_WORLD.rank == 0:
            print(json.dumps([wsph.compose(made).said, said]))
