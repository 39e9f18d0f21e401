"""Bodies whose pairs follow the motion are made anew in the middle of a run, by the processes that share them."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from wsph.backend.domain import Together


@dataclass(frozen=True)
class Remade:
    """What a body has been made anew by: the `layers` that this process holds at least, from one up to another, and the
    `visits` of pairs (l,) in its layers that it is cut by; None where these are those at the start."""

    layers: tuple[int, int] | None = None
    visits: np.ndarray | None = None

    def by(self, other: "Remade") -> "Remade":
        """What it is made by after this and another: where it is cut anew, what is around it is another."""
        return other if other.visits is not None else replace(self, layers=other.layers)


class Anew(Together):
    """A body is to be made anew in all processes that share it; its state is as it was."""

    def __init__(self, body: str, by: Remade):
        super().__init__(f"body {body!r} is to be made anew")
        self.body, self.by = body, by

    def after(self, remade: Mapping[str, Remade]) -> dict[str, Remade]:
        """What bodies are made by then, by their names, that had been made by `remade`."""
        return {**remade, self.body: remade.get(self.body, Remade()).by(self.by)}
