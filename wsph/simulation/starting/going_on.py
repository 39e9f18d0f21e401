"""What a run goes on from in the middle, where processes make a body anew that they share."""

# pyright: strict

import gc
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wsph.backend.device import give_back
from wsph.backend.domain import Domain
from wsph.doubts import keeping
from wsph.formulations.updated.sharing.anew import Anew, Remade
from wsph.scene.scene import Scene
from wsph.simulation.checkpoint import Found
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition


@dataclass(frozen=True)
class GoingOn:
    """A run up to here: its scene, the part of it that this process has, what bodies are made anew by, its folder, when it
    was asked for, the seconds in its steps, what it goes on from, the step that it began at where it has come to any, and
    what has been warned of."""

    scene: Scene
    domain: Domain
    remade: Mapping[str, Remade]
    folder: Path | None
    started: float
    inside: float
    found: Found | None
    first: int | None
    said: list[str]

    @classmethod
    def of(
        cls,
        was: Composition,
        asked: Anew,
        folder: Path | None,
        started: float,
        inside: float,
        found: Found | None,
        first: int | None,
    ) -> "GoingOn":
        """The run of a composition, in which a body is asked for to be made anew."""
        return cls(
            was.scene, was.domain, asked.after(was.remade), folder, started, inside, found, first, list(was.said)
        )

    def composed(self) -> Composition:
        """The scene made ready again, once what was before is gone."""
        gc.collect()
        with keeping(self.said):  # it has been said
            composition = compose(self.scene, self.domain, self.remade)
        composition.said = self.said
        composition.compile()
        give_back(composition.particles)
        return composition
