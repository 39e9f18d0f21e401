"""The clamped beam under impact of examples/rigid_plastic_beam.toml, by finite elements.

    python tests/references/struck_beam.py [--rows 7 14] [--speeds 20]

Explicit dynamics of the right half in numpy alone: four-node elements in plane strain with four Gauss points and the mean
dilatation of the element (B-bar), central differences, stresses turned by half of the step's spin before and after (Hughes &
Winget 1980), radial return to the yield surface. The projectile's lower nodes push on the beam's upper edge by a penalty.
Writes struck_beam.json: the mean deflection of the middle of the beam from 0.9 to 1.5 ms [mm], by speed and rows of
elements.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HEIGHT, HALF, FREE = 6.35e-3, 71.12e-3, 50.8e-3
WIDTH, LENGTH = 7.37e-3, 50e-3
ALUMINIUM = {"density": 2680.0, "youngs_modulus": 68.95e9, "poisson_ratio": 0.33, "yield_stress": 277.8e6}
STEEL = {"density": 14315.0, "youngs_modulus": 200e9, "poisson_ratio": 0.3, "yield_stress": 600e6}
END, LATE, BULK = 1.5e-3, 0.9e-3, 0.06
GAUSS = [(s / np.sqrt(3.0), t / np.sqrt(3.0)) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


@dataclass
class Mesh:
    """A block of elements between lines of x and y, nodes line by line."""

    lines: tuple[np.ndarray, np.ndarray]
    material: dict[str, float]

    def __post_init__(self) -> None:
        x, y = self.lines
        self.columns, self.rows = len(x) - 1, len(y) - 1
        self.x = np.array([a.ravel() for a in np.meshgrid(x, y)])  # (2, nodes)
        first = (np.arange(self.rows)[:, None] * (self.columns + 1) + np.arange(self.columns)).ravel()
        self.nodes = np.array([first, first + 1, first + self.columns + 2, first + self.columns + 1])  # (4, elements)
        m = self.material
        self.shear = m["youngs_modulus"] / (2.0 * (1.0 + m["poisson_ratio"]))
        self.bulk = m["youngs_modulus"] / (3.0 * (1.0 - 2.0 * m["poisson_ratio"]))
        self.speed = np.sqrt((self.bulk + 4.0 / 3.0 * self.shear) / m["density"])
        self.edge = min(np.diff(x).min(), np.diff(y).min())
        self.v = np.zeros_like(self.x)
        self.stress = np.zeros((4, 4, len(first)))  # xx, yy, zz, xy; Gauss points; elements
        _, volume = self.gradients(self.x)
        self.mass = self.gathered(np.repeat(m["density"] * volume.sum(0)[None] / 4.0, 4, 0))

    def gathered(self, values: np.ndarray) -> np.ndarray:
        """Sums at the nodes of values at the elements' corners, (4, elements)."""
        return np.bincount(self.nodes.ravel(), values.ravel(), self.x.shape[1])

    def gradients(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradients of the shape functions, (2, corner, Gauss point, element), and the points' volumes per width."""
        X, Y = x[0][self.nodes], x[1][self.nodes]
        out, volume = np.empty((2, 4, 4, X.shape[1])), np.empty((4, X.shape[1]))
        for g, (s, t) in enumerate(GAUSS):
            ds = 0.25 * np.array([-(1 - t), 1 - t, 1 + t, -(1 + t)])
            dt = 0.25 * np.array([-(1 - s), -(1 + s), 1 + s, 1 - s])
            xs, ys, xt, yt = ds @ X, ds @ Y, dt @ X, dt @ Y
            volume[g] = xs * yt - xt * ys
            out[0, :, g] = (np.outer(ds, np.ones(X.shape[1])) * yt - np.outer(dt, np.ones(X.shape[1])) * ys) / volume[g]
            out[1, :, g] = (np.outer(dt, np.ones(X.shape[1])) * xs - np.outer(ds, np.ones(X.shape[1])) * xt) / volume[g]
        return out, volume

    def flow(self, dt: float) -> None:
        """Positions and stresses after a step with the nodes' velocities."""
        B, volume = self.gradients(self.x + 0.5 * dt * self.v)
        u, w = self.v[0][self.nodes], self.v[1][self.nodes]
        xx, yy = np.einsum("ce,cge->ge", u, B[0]), np.einsum("ce,cge->ge", w, B[1])
        xy, yx = np.einsum("ce,cge->ge", u, B[1]), np.einsum("ce,cge->ge", w, B[0])
        part = ((xx + yy) * volume).sum(0) / volume.sum(0) - (xx + yy)
        rates = [xx + part / 3.0, yy + part / 3.0, part / 3.0]
        theta = sum(rates)
        angle = np.arctan(0.25 * dt * (yx - xy)) * 2.0
        self._turn(0.5 * angle)
        s = self.stress
        for k in range(3):
            s[k] += dt * (2.0 * self.shear * (rates[k] - theta / 3.0) + self.bulk * theta)
        s[3] += dt * self.shear * (xy + yx)
        mean = (s[0] + s[1] + s[2]) / 3.0
        size = np.sqrt(1.5 * ((s[0] - mean) ** 2 + (s[1] - mean) ** 2 + (s[2] - mean) ** 2 + 2.0 * s[3] ** 2))
        back = np.minimum(1.0, self.material["yield_stress"] / np.maximum(size, 1.0))
        for k in range(3):
            s[k] = mean + back * (s[k] - mean)
        s[3] *= back
        self._turn(0.5 * angle)
        self.x = self.x + dt * self.v
        self.damping = -BULK * self.material["density"] * self.speed * self.edge * theta[0]

    def _turn(self, angle: np.ndarray) -> None:
        c, s, (xx, yy, _, xy) = np.cos(angle), np.sin(angle), self.stress.copy()
        self.stress[0] = c * c * xx - 2.0 * s * c * xy + s * s * yy
        self.stress[1] = s * s * xx + 2.0 * s * c * xy + c * c * yy
        self.stress[3] = s * c * (xx - yy) + (c * c - s * s) * xy

    def force(self) -> np.ndarray:
        """Forces of the stresses at the nodes, (2, nodes)."""
        B, volume = self.gradients(self.x)
        s = self.stress
        mean = (s[0] + s[1] + s[2]) / 3.0
        pressure = (mean * volume).sum(0) - self.damping * volume.sum(0)
        bar = (B * volume).sum(2) / volume.sum(0)
        f0 = np.einsum("ge,cge->ce", (s[0] - mean) * volume, B[0]) + np.einsum("ge,cge->ce", s[3] * volume, B[1])
        f1 = np.einsum("ge,cge->ce", s[3] * volume, B[0]) + np.einsum("ge,cge->ce", (s[1] - mean) * volume, B[1])
        return -np.array([self.gathered(f0 + pressure * bar[0]), self.gathered(f1 + pressure * bar[1])])


def deflection(rows: int, speed: float) -> float:
    """The mean deflection of the middle [mm] with `rows` elements across the beam."""
    size = HEIGHT / rows
    # With a line where the clamp begins.
    free, clamped = (np.linspace(a, b, round((b - a) / size) + 1) for a, b in ((0.0, FREE), (FREE, HALF)))
    beam = Mesh((np.concatenate([free, clamped[1:]]), np.linspace(0.0, HEIGHT, rows + 1)), ALUMINIUM)
    columns = round(WIDTH / size)
    upwards = np.linspace(HEIGHT, HEIGHT + LENGTH, round(LENGTH / size) + 1)
    striker = Mesh((np.linspace(0.0, WIDTH, columns + 1), upwards), STEEL)
    striker.v[1] = -speed
    clamp = beam.x[0] > FREE - 1e-9
    held = [(0, beam.x[0] < 1e-9), (0, clamp), (1, clamp)]
    middle = np.flatnonzero(beam.x[0] < 1e-9)
    upper, lower = slice(rows * (beam.columns + 1), None), slice(0, columns + 1)
    share = np.where(np.isin(np.arange(columns + 1), (0, columns)), 0.5, 1.0) * WIDTH / columns
    stiffness = beam.bulk / size * share
    dt = 0.4 * min(beam.edge / beam.speed, striker.edge / striker.speed)
    start, found = beam.x[1, middle].copy(), []
    for mesh in (beam, striker):
        mesh.damping = np.zeros(mesh.nodes.shape[1])
    for step in range(int(END / dt)):
        force, other = beam.force(), striker.force()
        x, y = beam.x[0, upper], beam.x[1, upper]
        at = striker.x[0, lower]
        k = np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2)
        along = (at - x[k]) / (x[k + 1] - x[k])
        push = stiffness * np.maximum((1.0 - along) * y[k] + along * y[k + 1] - striker.x[1, lower], 0.0)
        other[1, lower] += push
        force[1, upper] -= np.bincount(k, (1.0 - along) * push, len(x)) + np.bincount(k + 1, along * push, len(x))
        beam.v += dt * (force / beam.mass)
        striker.v += dt * (other / striker.mass)
        for axis, nodes in held:
            beam.v[axis, nodes] = 0.0
        striker.v[0, striker.x[0] < 1e-9] = 0.0
        beam.flow(dt)
        striker.flow(dt)
        if (step + 1) * dt > LATE:
            found.append((start - beam.x[1, middle]).mean())
    return 1e3 * float(np.mean(found))


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[7, 14])
    parser.add_argument("--speeds", type=float, nargs="+", default=[20.0])
    options = parser.parse_args()
    path = Path(__file__).with_suffix(".json")
    found = json.loads(path.read_text()) if path.exists() else {}
    for speed in options.speeds:
        for rows in options.rows:
            found.setdefault(f"{speed:g} m/s", {})[str(rows)] = deflection(rows, speed)
            print(speed, rows, found[f"{speed:g} m/s"][str(rows)], flush=True)
            path.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
