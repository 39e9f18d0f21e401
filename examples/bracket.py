"""Writes a bracket as an STL file, in millimetres: a plate with a through hole, a boss and a slanted end.

    python examples/bracket.py bracket.stl

The plate is 60 mm long below and 52 mm on top, 30 mm wide and 12 mm high; the hole has a radius of 6 mm, the boss one of
7 mm and a height of 10 mm.
"""

# pyright: strict

import sys
from pathlib import Path

import numpy as np

LENGTH, TOP, WIDTH, HEIGHT = 60.0, 52.0, 30.0, 12.0
MIDDLE = 25.0
"""Between the half of the plate with the hole and that with the boss."""
HOLE, HOLE_AT = 6.0, (12.5, 15.0)
BOSS, BOSS_AT, BOSS_HEIGHT = 7.0, (38.5, 15.0), 10.0

Triangles = list[tuple[np.ndarray, np.ndarray, np.ndarray]]


def circle(center: tuple[float, float], radius: float, z: float, count: int) -> np.ndarray:
    """Points around, counter-clockwise from the first quadrant's corner, (count, 3)."""
    angle = 2.0 * np.pi * (np.arange(count) / count)
    return np.stack([center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle), np.full(count, z)], 1)


def quad(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> Triangles:
    """Two triangles around a, b, c, d."""
    return [(a, b, c), (a, c, d)]


def holed(low: float, high: float, z: float, around: np.ndarray) -> Triangles:
    """A rectangle over the plate's width without the disc that is `around`, as seen from above: every corner sees the
    quarter of the circle that is next to it."""
    corners = np.array([[high, WIDTH, z], [low, WIDTH, z], [low, 0.0, z], [high, 0.0, z]])
    found: Triangles = []
    quarter = len(around) // 4
    for k in range(4):
        for i in range(k * quarter, (k + 1) * quarter):
            found.append((corners[k], around[(i + 1) % len(around)], around[i]))
        found.append((corners[k], corners[(k + 1) % 4], around[(k + 1) * quarter % len(around)]))
    return found


def tube(below: np.ndarray, above: np.ndarray) -> Triangles:
    """The mantle between two circles, as seen from outside."""
    below_next, above_next = np.roll(below, -1, axis=0), np.roll(above, -1, axis=0)
    return [t for rows in zip(below, below_next, above_next, above, strict=True) for t in quad(*rows)]


def bracket(count: int = 48) -> np.ndarray:
    """The triangles' corners (f, 3, 3) [mm], with so many sides around hole and boss."""
    hole = [circle(HOLE_AT, HOLE, z, count) for z in (0.0, HEIGHT)]
    boss = [circle(BOSS_AT, BOSS, z, count) for z in (HEIGHT, HEIGHT + BOSS_HEIGHT)]
    (a, b, c), (d, e, f) = (
        [np.array([x, 0.0, z]) for x in ends]
        for z, ends in ((0.0, (0.0, MIDDLE, LENGTH)), (HEIGHT, (0.0, MIDDLE, TOP)))
    )
    back = np.array([0.0, WIDTH, 0.0])
    triangles = holed(0.0, MIDDLE, HEIGHT, hole[1]) + holed(MIDDLE, TOP, HEIGHT, boss[0])
    triangles += [(p, r, q) for p, q, r in holed(0.0, MIDDLE, 0.0, hole[0])] + quad(b, b + back, c + back, c)
    triangles += quad(a, b, e, d) + quad(b, c, f, e)
    triangles += quad(b + back, a + back, d + back, e + back) + quad(c + back, b + back, e + back, f + back)
    triangles += quad(a + back, a, d, d + back) + quad(c, c + back, f + back, f)
    triangles += [(p, r, q) for p, q, r in tube(*hole)] + tube(*boss)
    middle = np.array([*BOSS_AT, HEIGHT + BOSS_HEIGHT])
    triangles += [(middle, p, q) for p, q in zip(boss[1], np.roll(boss[1], -1, axis=0), strict=True)]
    return np.array(triangles)


def write_stl(path: Path, triangles: np.ndarray) -> None:
    """Triangles (f, 3, 3) as a binary STL file."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows = np.zeros(len(triangles), record)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    rows["normal"], rows["corners"] = normal / np.linalg.norm(normal, axis=1, keepdims=True), triangles
    path.write_bytes(b"bracket".ljust(80) + len(rows).to_bytes(4, "little") + rows.tobytes())


if __name__ == "__main__":
    write_stl(Path(sys.argv[1]), bracket())
