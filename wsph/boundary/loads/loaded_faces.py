"""Faces of a body that a load which follows the motion acts on, by their particles."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import Domain, Share
from wsph.boundary.programs.prescribed import Prescribed
from wsph.ranks.kept import Rows


@dataclass(frozen=True)
class LoadedFaces:
    """Selected faces of a body by their particles: `particle` (k,), ascending, `area` (k,) of the faces that each stands for
    and `normal` (k, dim) outward unit vectors, in the reference configuration, nondimensional.

    By the f faces: `corners` (f, c) their particles, and `vector` (f, c, dim) the integrals of N_j n, n outward. `place` (n,
    dim) [m] of all particles of the body; `values` what the load's keys prescribe, in SI units; `share` the part of the
    body's particles that they are, in a `domain`; `impedance` the density times the speeds of waves along and across their
    way at the start [Pa s/m].
    """

    particle: np.ndarray
    area: np.ndarray
    normal: np.ndarray
    corners: np.ndarray
    vector: np.ndarray
    place: np.ndarray
    values: Mapping[str, Prescribed]
    share: Share
    domain: Domain
    impedance: tuple[float, float] = (0.0, 0.0)

    @property
    def own(self) -> np.ndarray:
        """Which of its particles this process owns, (k,) bool."""
        return self.share.owns(self.particle)

    @property
    def middle(self) -> np.ndarray:
        """The middle of the bounds of the whole body (dim,) [m]."""
        return 0.5 * (self.domain.min(self.place.min(0)) + self.domain.max(self.place.max(0)))

    @property
    def rows(self) -> Rows:
        """Where what is kept of every particle stands in what all processes keep."""
        return Rows.by_keys(self.particle[:, None] + self.share.first, self.own, self.domain)

    @property
    def own_rows(self) -> Rows:
        """The same of what is kept of those that a process owns."""
        keys = self.particle[self.own, None] + self.share.first
        return Rows.by_keys(keys, np.ones(len(keys), bool), self.domain)
