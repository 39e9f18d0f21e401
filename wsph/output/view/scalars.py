"""The scalar that stands for a field in a picture."""

# pyright: strict

import difflib
import re
from dataclasses import dataclass

import numpy as np

from wsph.errors import OutputError
from wsph.output.fields import AXES, DEFORMATION, DERIVED, TENSOR, UNITS, primitive, von_mises
from wsph.output.view.recorded import Shot


@dataclass(frozen=True)
class Scalar:
    """Numbers of a picture: their `name` and `unit`, and `values` of its cells, or of its points."""

    name: str
    unit: str
    values: np.ndarray
    in_cells: bool

    @property
    def finite(self) -> np.ndarray:
        """The values that are numbers: a body without the field has none."""
        there = self.values[np.isfinite(self.values)]
        if not len(there):
            raise OutputError(f"{self.name!r} is no finite number anywhere in the frame: there is nothing to draw")
        return there


def scalar(shot: Shot, name: str, smooth: bool = False) -> Scalar:
    """The scalar of a field: of cells as computed where there is such, unless it is to be `smooth`; otherwise of points. A
    vector stands by its length and a stress by von Mises', in one dimension both by their component. Without a `name` it is
    the velocity, or the first field that the frame has. Raises OutputError for a field that it does not have."""
    points = {key: np.asarray(shot.grid.point_data[key]) for key in shot.grid.point_data}
    cells = {} if smooth else {key: np.asarray(shot.grid.cell_data[key]) for key in shot.grid.cell_data}
    ids = ("id", "body")
    there = [key for key in (*points, *cells) if key not in ids]
    name = name or next((key for key in ("velocity", *there) if key in there), "velocity")
    for data, inside in (({k: v for k, v in cells.items() if k not in ids}, True), (points, False)):
        found = _component(data, name)
        if found is not None:
            label, values = found
            base = primitive(label.strip("|"))
            unit = shot.units.get(label) or shot.units.get(base) or shot.units.get(name) or UNITS.get(base, "")
            return Scalar(label, unit, values.astype(float), inside)
    known = list(dict.fromkeys(there))
    near = difflib.get_close_matches(name, known, 1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise OutputError(
        f"no field {name!r} in the frame{hint}; there is {', '.join(known)}, and output.fields adds others"
    )


def _component(data: dict[str, np.ndarray], name: str) -> tuple[str, np.ndarray] | None:
    """The label and the values (n,) of a field; None where the data have none."""
    match = re.fullmatch(r"(velocity|displacement)_([xyz])", name)
    if match and match[1] in data and AXES.index(match[2]) < data[match[1]].shape[1]:
        return name, data[match[1]][:, AXES.index(match[2])]
    match = re.fullmatch(rf"stress_({'|'.join(TENSOR)})", name)
    if match and "stress" in data:
        return name, data["stress"][:, TENSOR.index(match[1])]
    match = re.fullmatch(rf"strain_({'|'.join(TENSOR)})", name)
    if match and "strain" in data:
        return name, data["strain"][:, TENSOR.index(match[1])]
    base = "strain" if name in DERIVED and DERIVED[name].primitive == DEFORMATION else "stress"
    if name in DERIVED and name not in data and base in data:
        return name, DERIVED[name].of(data[base])
    values = data.get(name)
    if values is None or values.ndim == 1:
        return None if values is None else (name, values)
    alone = not np.any(values[:, 1:])
    if name == "stress":
        return ("stress_xx", values[:, 0]) if alone else ("von_mises", von_mises(values))
    return (f"{name}_x", values[:, 0]) if alone else (f"|{name}|", np.linalg.norm(values, axis=1))
