"""Fields by name: those that a scene may ask for, and how each follows from a state.

A primitive field stands in the state (velocity, stress, displacement, internals); the others are computed from those on
the host. Arrays are SI, with any leading shape: (..., width) for primitives and components.
"""

# pyright: strict

from collections.abc import Iterable

import numpy as np

TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")
"""Order of a symmetric tensor's components, VTK's."""

AXES = ("x", "y", "z")

ALWAYS = ("position", "id", "body")
"""Fields that every frame has, asked for or not."""

ON_SURFACES = {"contact_pressure": "Pa", "contact_gap": "m"}
"""Fields of bodies that meet others, ties and tools, on their surfaces, and their units: of frames alone."""

DERIVED = {"von_mises": "stress", "pressure": "stress"}


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
    ]


def primitive(name: str) -> str:
    """The primitive field that `name` is computed from ("density" is its own)."""
    base, _, component = name.rpartition("_")
    if (base in ("velocity", "displacement") and component in AXES) or (base == "stress" and component in TENSOR):
        return base
    return DERIVED.get(name, name)


def columns(name: str, labels: tuple[str, ...], dim: int) -> list[str]:
    """Component fields that `name` stands for: "velocity" gives velocity_x, ...; a component gives itself."""
    if name in ("velocity", "displacement"):
        return [f"{name}_{axis}" for axis in AXES[:dim]]
    return [f"stress_{label}" for label in labels] if name == "stress" else [name]


def tensor(stress: np.ndarray, labels: tuple[str, ...]) -> np.ndarray:
    """(..., 6) in VTK's order from kept components (..., width); those not kept are zero by the stress state."""
    full = np.zeros((*stress.shape[:-1], 6))
    for k, label in enumerate(labels):
        full[..., TENSOR.index(label)] = stress[..., k]
    return full


def von_mises(full: np.ndarray) -> np.ndarray:
    """sqrt(3/2 s:s) of (..., 6)."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(full, -1, 0)
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2))


def component(name: str, values: np.ndarray, labels: tuple[str, ...]) -> np.ndarray:
    """The scalar field `name`, (...), from its primitive's values (..., width)."""
    if name == "von_mises":
        return von_mises(tensor(values, labels))
    if name == "pressure":
        return -tensor(values, labels)[..., :3].sum(-1) / 3.0
    base, _, part = name.rpartition("_")
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
    return values if name in ("velocity", "displacement") else component(name, values, labels)
