"""The rows of a study before they run: every variant at every place of its grid, and all that a row follows from."""

# pyright: strict

import hashlib
import itertools
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from wsph.errors import Fault, SceneError
from wsph.scene.files import file_digests
from wsph.scene.scene import Scene
from wsph.study.tables import Study, Variant


@dataclass(frozen=True)
class Planned:
    """A run to be made: the variant's name, its place in the grid, and the scene."""

    variant: str
    place: dict[str, object]
    scene: Scene

    @property
    def name(self) -> str:
        """What people call it."""
        at = ", ".join(f"{key} = {value}" for key, value in self.place.items())
        return f"{self.variant}: {at}" if at else self.variant

    @property
    def ladder(self) -> str:
        """What rows that differ in their spacing alone have in common."""
        rest = [f"{key} = {value}" for key, value in self.place.items() if not _is_spacing(key)]
        return ", ".join([self.variant, *rest])

    @property
    def spacing(self) -> float | None:
        """The coarsest spacing of its bodies [m], None where all are from mesh files."""
        edges = [float(np.max(body.spacing)) for body in self.scene.bodies if body.spacing is not None]
        return max(edges, default=None)


@dataclass(frozen=True)
class Facts:
    """Digests of all that a row follows from: its scene with the files that bodies name, the answer that it is compared
    with, and the versions of the programs."""

    scene: str
    oracle: str
    versions: str

    @property
    def key(self) -> str:
        """One word for all."""
        return _digest([self.scene, self.oracle, self.versions])[:20]

    def changed(self, other: "Facts") -> str:
        """What is not as in another, in words."""
        words = {"scene": "scene", "oracle": "answer", "versions": "version of wsph or of Warp"}
        return " and another ".join(said for key, said in words.items() if getattr(self, key) != getattr(other, key))


def planned(study: Study, scene: Scene) -> list[Planned]:
    """Every row, variant by variant. Raises SceneError for an override that the scene cannot take."""
    shared = scene.with_(**study.set) if study.set else scene
    return [each for variant in study.variants for each in _of_variant(study, variant, shared)]


def facts(study: Study, plan: Sequence[Planned], folder: Path) -> list[Facts]:
    """What each row of a plan follows from, in order; `folder` has the reference's file. Raises SceneError for a reference
    that cannot be read."""
    oracle = study.oracle
    answer = [oracle.model_dump_json(), oracle.content(folder)] if oracle is not None else []
    shared = _digest([*answer, list(study.judged)]), _digest([version("wsph"), version("warp-lang")])
    found: list[Facts] = []
    for row in plan:
        whole = row.scene.model_dump(mode="json", by_alias=True)
        found.append(Facts(_digest([row.name, whole, file_digests(whole["bodies"])]), *shared))
    return found


def _of_variant(study: Study, variant: Variant, scene: Scene) -> Iterator[Planned]:
    grid = study.grid | variant.grid
    if strange := [key for key in variant.grid if key not in study.grid]:
        raise SceneError("study", [Fault(0, "variants", f"{variant.name}: the grid of all has no {strange[0]!r}")])
    for values in itertools.product(*grid.values()):
        place = dict(zip(grid, values, strict=True))
        single = {key.strip(): value for keys, value in place.items() for key in keys.split(",")}
        yield Planned(variant.name, place, scene.with_(**variant.set, **single))


def _is_spacing(keys: str) -> bool:
    return all(key.strip().endswith(".spacing") for key in keys.split(","))


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, default=str).encode()).hexdigest()
