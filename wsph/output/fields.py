"""Fields by name: those that a scene may ask for, and how each follows from a state.

A primitive field stands in the state (velocity, stress, displacement, deformation, internals); the others are computed from
those on the host. Arrays are SI, with any leading shape: (..., width) for primitives and components.
"""

# pyright: strict

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from wsph.expressions import Expression

TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")
"""Order of a symmetric tensor's components, VTK's."""

AXES = ("x", "y", "z")

ALWAYS = ("position", "id", "body")
"""Fields that every frame has, asked for or not."""

ON_SURFACES = {"contact_pressure": "Pa", "contact_gap": "m"}
"""Fields of bodies that meet others, ties and tools, on their surfaces, and their units: of frames alone."""

UNITS = {
    "velocity": "m/s",
    "displacement": "m",
    "stress": "Pa",
    "density": "kg/m3",
    "position": "m",
    "dissipation": "Pa",
}
"""Of primitives, and of what frames have beside them; of others it is a material's to say."""

DEFORMATION = "deformation"
"""The primitive field that strains are computed from: F - I, row by row, (..., dim^2). No scene names it."""


@dataclass(frozen=True)
class Derived:
    """A scalar field that follows from one primitive: what it is, in words, and how it comes of a tensor (..., 6)."""

    primitive: str
    said: str
    of: Callable[[np.ndarray], np.ndarray]


def von_mises(full: np.ndarray) -> np.ndarray:
    """sqrt(3/2 s:s) of (..., 6)."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(full, -1, 0)
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2))


def principal(full: np.ndarray) -> np.ndarray:
    """Principal values of (..., 6), the largest first, (..., 3); NaN where a component is no number."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(full, -1, 0)
    matrix = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(*full.shape[:-1], 3, 3)
    finite = np.isfinite(full.sum(-1))
    found = np.linalg.eigvalsh(np.where(finite[..., None, None], matrix, 0.0))[..., ::-1]
    return np.where(finite[..., None], found, np.nan)


def _principal(k: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda full: principal(full)[..., k]


def _largest_shear(full: np.ndarray) -> np.ndarray:
    found = principal(full)
    return 0.5 * (found[..., 0] - found[..., 2])


DERIVED: dict[str, Derived] = {
    "von_mises": Derived("stress", "equivalent stress after von Mises, sqrt(3/2 s:s)", von_mises),
    "pressure": Derived(
        "stress", "minus the mean normal stress; positive in compression", lambda s: -s[..., :3].mean(-1)
    ),
    "principal_stress_1": Derived("stress", "the largest principal stress, tension positive", _principal(0)),
    "principal_stress_2": Derived("stress", "the middle principal stress", _principal(1)),
    "principal_stress_3": Derived("stress", "the smallest principal stress", _principal(2)),
    "max_shear": Derived(
        "stress", "the largest shear stress, after Tresca: half of the largest less the smallest", _largest_shear
    ),
    "principal_strain_1": Derived(DEFORMATION, "the largest principal strain of Green and Lagrange", _principal(0)),
    "principal_strain_3": Derived(DEFORMATION, "the smallest principal strain of Green and Lagrange", _principal(2)),
}
"""Scalars that follow from the stress or from the strain, by name. In 1D and 2D the strain has its components in the plane
alone, those across are taken as zero."""


_STRAINS = {1: ("xx",), 2: ("xx", "yy", "xy"), 3: TENSOR}
"""Components of a strain by dimension."""


@dataclass(frozen=True)
class Formula:
    """A scalar field that a scene makes of others, by an expression of their names and of the reference position."""

    expression: Expression
    unit: str = ""

    @property
    def needs(self) -> tuple[str, ...]:
        """The scalar fields that it is made of."""
        return self.expression.names

    def of(self, values: Mapping[str, np.ndarray], labels: tuple[str, ...], position: np.ndarray) -> np.ndarray:
        """Its values (...) from those of primitives (..., width), at places (n, dim) along the last axis of these."""
        parts = [component(name, values[primitive(name)], labels) for name in self.needs]
        shape = np.broadcast_shapes(*(part.shape for part in parts), position.shape[:1])
        places = np.broadcast_to(position, (*shape, position.shape[1])).reshape(-1, position.shape[1])
        given = [np.broadcast_to(part, shape).reshape(-1) for part in parts]
        return self.expression(places, values=given).reshape(shape)


Formulas = Mapping[str, Formula]


def primitives(name: str, formulas: Formulas) -> tuple[str, ...]:
    """The primitive fields that a field is computed from, a formula's too."""
    return tuple(dict.fromkeys(map(primitive, formulas[name].needs))) if name in formulas else (primitive(name),)


def known(internals: Iterable[str], dim: int, offered: Iterable[str] = ()) -> list[str]:
    """Every field name that a body with those internals offers, and what its parts do."""
    vectors = [f"{name}_{axis}" for name in ("velocity", "displacement") for axis in AXES[:dim]]
    return [
        *ALWAYS,
        "velocity",
        "displacement",
        "stress",
        "density",
        *DERIVED,
        *ON_SURFACES,
        *offered,
        *internals,
        *vectors,
        *(f"stress_{c}" for c in TENSOR),
        "strain",
        *(f"strain_{c}" for c in _STRAINS[dim]),
    ]


def primitive(name: str) -> str:
    """The primitive field that `name` is computed from ("density" is its own)."""
    base, _, component = name.rpartition("_")
    if (base in ("velocity", "displacement") and component in AXES) or (base == "stress" and component in TENSOR):
        return base
    if name == "strain" or (base == "strain" and component in TENSOR):
        return DEFORMATION
    return DERIVED[name].primitive if name in DERIVED else name


def columns(name: str, labels: tuple[str, ...], dim: int) -> list[str]:
    """Component fields that `name` stands for: "velocity" gives velocity_x, ...; a component gives itself."""
    if name in ("velocity", "displacement"):
        return [f"{name}_{axis}" for axis in AXES[:dim]]
    if name == "strain":
        return [f"strain_{label}" for label in _STRAINS[dim]]
    return [f"stress_{label}" for label in labels] if name == "stress" else [name]


def tensor(stress: np.ndarray, labels: tuple[str, ...]) -> np.ndarray:
    """(..., 6) in VTK's order from kept components (..., width); those not kept are zero by the stress state."""
    full = np.zeros((*stress.shape[:-1], 6))
    for k, label in enumerate(labels):
        full[..., TENSOR.index(label)] = stress[..., k]
    return full


def strain(deformation: np.ndarray) -> np.ndarray:
    """Green and Lagrange's strain (H + H^T + H^T H)/2 in VTK's order, (..., 6), from H = F - I, (..., dim^2): components of
    tensors, so that a shear is half of the angle."""
    dim = math.isqrt(deformation.shape[-1])
    H = deformation.reshape(*deformation.shape[:-1], dim, dim)
    E = 0.5 * (H + np.swapaxes(H, -1, -2) + np.swapaxes(H, -1, -2) @ H)
    full = np.zeros((*deformation.shape[:-1], 6))
    for label in _STRAINS[dim]:
        full[..., TENSOR.index(label)] = E[..., AXES.index(label[0]), AXES.index(label[1])]
    return full


def said(name: str) -> str:
    """What a field is, in words; "" of one that this file does not have words for."""
    words = {
        "position": "where particles are, or were at the start (output.positions)",
        "id": "number of a particle",
        "body": "number of its body",
        "velocity": "velocity, a vector",
        "displacement": "displacement from the reference position, a vector",
        "stress": "Cauchy stress, a symmetric tensor; tension is positive",
        "strain": "strain of Green and Lagrange, a symmetric tensor (of forms that follow the deformation)",
        "density": "density in the present configuration",
        "contact_pressure": "pressure on the surface by contact, ties and tools",
        "contact_gap": "distance to what may be touched",
        "damage": "damage, 0 to 1 (of bodies with links or a phase field)",
        "dissipation": "dissipated energy per volume at the start, as plastic work (of laws that can take energy)",
    }
    return DERIVED[name].said if name in DERIVED else words.get(name, "")


def component(name: str, values: np.ndarray, labels: tuple[str, ...]) -> np.ndarray:
    """The scalar field `name`, (...), from its primitive's values (..., width)."""
    if name in DERIVED:
        return DERIVED[name].of(tensor(values, labels) if DERIVED[name].primitive == "stress" else strain(values))
    base, _, part = name.rpartition("_")
    if base == "strain":
        return strain(values)[..., TENSOR.index(part)]
    if base == "stress" and part in TENSOR:
        return values[..., labels.index(part)] if part in labels else np.zeros(values.shape[:-1])
    if base in ("velocity", "displacement"):
        return values[..., AXES.index(part)]
    return values[..., 0]


def shown(name: str, values: np.ndarray, labels: tuple[str, ...]) -> np.ndarray:
    """The field `name` as frames carry it, from its primitive's values (..., width): a vector whole, a stress as (..., 6),
    anything else as the scalar or the component that it is."""
    if name == "stress":
        return tensor(values, labels)
    if name == "strain":
        return strain(values)
    return values if name in ("velocity", "displacement") else component(name, values, labels)
