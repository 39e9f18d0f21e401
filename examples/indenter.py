"""Writes a pyramid as an STL file, in millimetres, with its tip at the origin and its base above: a Vickers indenter.

    python examples/indenter.py indenter.stl

Opposite faces make an angle of 136 degrees. The tip is cut off flat by a little square, as every real one is.
"""

# pyright: strict

import sys
from pathlib import Path

import numpy as np

HALF = np.deg2rad(68.0)
"""Between a face and the axis."""
FLAT, HEIGHT = 0.02, 0.6
"""Half of the edge of the flat tip, and the height."""


def pyramid() -> np.ndarray:
    """Corners of the triangles, counter-clockwise from outside, (12, 3, 3)."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    low = np.column_stack([FLAT * square, np.zeros(4)])
    high = np.column_stack([(FLAT + HEIGHT * np.tan(HALF)) * square, np.full(4, HEIGHT)])
    found = [
        (low[0], low[2], low[1]),
        (low[0], low[3], low[2]),
        (high[0], high[1], high[2]),
        (high[0], high[2], high[3]),
    ]
    for k in range(4):
        n = (k + 1) % 4
        found += [(low[k], low[n], high[n]), (low[k], high[n], high[k])]
    return np.array(found)


def main() -> None:
    lines = ["solid indenter"]
    for corners in pyramid():
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        lines.append("facet normal " + " ".join(f"{x:.9g}" for x in normal))
        lines.append(" outer loop")
        lines += ["  vertex " + " ".join(f"{x:.9g}" for x in corner) for corner in corners]
        lines += [" endloop", "endfacet"]
    Path(sys.argv[1]).write_text("\n".join([*lines, "endsolid indenter", ""]))


if __name__ == "__main__":
    main()
