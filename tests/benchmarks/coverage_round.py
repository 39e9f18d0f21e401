"""Round bodies whose cells are fitted to their surface, with answers in closed form, for coverage.py: E = rho = 1, and
motions so small that they are linear.

KNOWN and FRESH as in coverage_scenes.py. ROUND were written when estimates had turned out to be too small on one of the
others: the highest order of fitted bodies (`wsph.accuracy.envelope.ORDERS_OF_FITTED`) was chosen on them, and then put to
the test on the others.
"""

import math
from collections.abc import Callable

import numpy as np
from coverage_scenes import COARSER, FINER, SMALL, Case, _elastic, _probe, _scene
from scipy import optimize, special

from wsph.validation import oracles

RATIO = 0.3
"""Poisson's, of all of them but one."""

SHEAR = 0.5 / (1.0 + RATIO)
"""The shear modulus."""


def _series(k, terms, first, step, dim=3):
    """A power series in q = (k r)^2, of its `first` factor and the ratios of its terms, as an expression of x, y, z."""
    factors = [first]
    for m in range(1, terms):
        factors.append(factors[-1] * step(m))
    return _polynomial([c * k ** (2 * m) for m, c in enumerate(factors)], "(x*x+y*y+z*z)" if dim == 3 else "(x*x+y*y)")


def _polynomial(factors, of):
    """By Horner's rule."""
    text = f"{factors[-1]:.12g}"
    for factor in reversed(factors[:-1]):
        text = f"({factor:.12g}+{of}*{text})"
    return text


def _bessel(k):
    """J1(k r)/r as an expression, and as a number of r."""
    text = _series(k, 7, 0.5 * k, lambda m: -0.25 / (m * (m + 1)), dim=2)
    return text, lambda r: sum((-1) ** m * (0.5 * k) * (0.5 * k * r) ** (2 * m) / (math.factorial(m) * math.factorial(m + 1)) for m in range(16))  # fmt: skip


def _disc(name, kind, surface, spacing, work):
    ratio = 0.3
    low, high = 1.8, 2.3  # of k J0(k) = (1 - nu) J1(k)
    j0 = lambda k: sum((-1) ** m * (0.5 * k) ** (2 * m) / math.factorial(m) ** 2 for m in range(20))  # noqa: E731
    j1 = lambda k: _bessel(k)[1](1.0)  # noqa: E731
    for _ in range(60):
        k = 0.5 * (low + high)
        low, high = (k, high) if k * j0(k) > (1.0 - ratio) * j1(k) else (low, k)
    text, value = _bessel(k)
    omega = k / math.sqrt(1.0 - ratio**2)
    scene = _scene(2, {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, spacing, form="stress-points", end=5.0,
                   material=_elastic(ratio), body={"surface": surface, "velocity": [f"{SMALL}*x*{text}", f"{SMALL}*y*{text}"]},
                   probes=_probe([0.5, 0.0], "velocity_x"))  # fmt: skip
    exact = {"p.velocity_x": lambda t: SMALL * 0.5 * value(0.5) * np.cos(omega * t)}
    if kind == "fitted":  # which converges fast enough for tolerances of bars
        return Case(name, kind, scene, exact, work, tolerances=FINER)
    # What a search of a staircase wants is ten times what it takes: it is refused at smaller limits.
    return Case(name, kind, scene, exact, work, tolerances=(0.1, *COARSER), limit=50.0)


def _sphere():
    k, omega = oracles.breathing_sphere()
    text = _series(k, 7, 1.0, lambda m: -1.0 / ((2 * m) * (2 * m + 3)))
    at = lambda r: 3.0 / (k * r) ** 2 * (math.sin(k * r) / (k * r) - math.cos(k * r))  # noqa: E731
    scene = _scene(3, {"type": "sphere", "center": [0.0] * 3, "radius": 1.0}, 2.0 / 12, form="stress-points", end=5.0,
                   material=_elastic(oracles.RATIO), body={"surface": "fitted", "velocity": [f"{SMALL}*{axis}*{text}" for axis in "xyz"]},
                   probes=_probe([0.5, 0.0, 0.0], "velocity_x"))  # fmt: skip
    exact = {"p.velocity_x": lambda t: SMALL * 0.5 * at(0.5) * np.cos(omega * t)}
    return Case("breathing sphere, fitted", "fitted", scene, exact, 2e7)


def _torsion():
    length, ratio = 2.0, 0.3
    wave = f"{SMALL}*cos({math.pi / length!r}*z)"
    omega = math.pi / length * math.sqrt(0.5 / (1.0 + ratio))
    scene = _scene(3, {"type": "cylinder", "from": [0.0] * 3, "to": [0.0, 0.0, length], "radius": 0.5}, 1.0 / 8,
                   form="stress-points", end=6.0, material=_elastic(ratio),
                   body={"surface": "fitted", "velocity": [f"-y*{wave}", f"x*{wave}", "0"]}, probes=_probe([0.25, 0.0, 0.5], "velocity_y"))  # fmt: skip
    exact = {"p.velocity_y": lambda t: SMALL * 0.25 * math.cos(0.25 * math.pi) * np.cos(omega * t)}
    return Case("round bar in torsion, fitted", "fitted", scene, exact, 2e7)


def _annulus():
    """The first breathing mode of a ring of radii 0.5 and 1, plane stress, by a fine mesh of the radius alone."""
    ratio, n = 0.3, 400
    r = np.linspace(0.5, 1.0, n + 1)
    stiff, mass = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    law = np.array([[1.0, ratio], [ratio, 1.0]]) / (1.0 - ratio**2)
    for e in range(n):
        h, pair = r[e + 1] - r[e], np.ix_([e, e + 1], [e, e + 1])
        for s in (-(3.0**-0.5), 3.0**-0.5):
            shape = np.array([0.5 * (1.0 - s), 0.5 * (1.0 + s)])
            at = shape @ r[[e, e + 1]]
            strain = np.array([[-1.0 / h, 1.0 / h], shape / at])
            stiff[pair] += 0.5 * h * at * strain.T @ law @ strain
            mass[pair] += 0.5 * h * at * np.outer(shape, shape)
    values, modes = np.linalg.eig(np.linalg.solve(mass, stiff))
    first = int(np.argmin(values.real))
    omega, mode = math.sqrt(values[first].real), modes[:, first].real / modes[-1, first].real
    fit = np.polynomial.Polynomial.fit(r, mode / r, 6).convert().coef
    text = _polynomial(fit.tolist(), "sqrt(x*x+y*y)")
    ring = {"type": "difference", "shapes": [{"type": "disc", "center": [0.0, 0.0], "radius": 1.0},
                                             {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}]}  # fmt: skip
    scene = _scene(2, ring, 1.0 / 12, form="stress-points", end=1.5 * 2.0 * math.pi / omega, material=_elastic(ratio),
                   body={"surface": "fitted", "velocity": [f"{SMALL}*x*{text}", f"{SMALL}*y*{text}"]},
                   probes=_probe([0.75, 0.0], "velocity_x"))  # fmt: skip
    at = float(np.interp(0.75, r, mode))
    exact = {"p.velocity_x": lambda t: SMALL * at * np.cos(omega * t)}
    return Case("breathing ring, fitted", "fitted", scene, exact, 1e7, tolerances=FINER)


def _turning():
    """A free disc that turns about its middle to and fro, ring against ring: J1(k r) with J2(k) = 0, which the traction on
    its edge goes with. Added after fitted bodies had an estimate, whose form was changed once more with it in view."""
    ratio, k = 0.3, 5.135622301840683
    _, value = _bessel(k)
    square = np.linspace(0.0, 1.0, 200)
    fit = np.polynomial.Polynomial.fit(square, [value(math.sqrt(each)) for each in square], 6).convert().coef
    text = _polynomial(fit.tolist(), "(x*x+y*y)")
    omega = k * math.sqrt(0.5 / (1.0 + ratio))
    scene = _scene(2, {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, 2.0 / 12, form="stress-points", end=3.0,
                   material=_elastic(ratio), body={"surface": "fitted", "velocity": [f"-{SMALL}*y*{text}", f"{SMALL}*x*{text}"]},
                   probes=_probe([0.5, 0.0], "velocity_y"))  # fmt: skip
    exact = {"p.velocity_y": lambda t: SMALL * 0.5 * value(0.5) * np.cos(omega * t)}
    return Case("turning disc, fitted", "fitted", scene, exact, 1e7, tolerances=FINER)


# --- written to see how safe estimates are ----------------------------------------------------------------------------


def _lowest(function, low, high, count=400):
    """The lowest root of a function of a wave number or a frequency."""
    at = np.linspace(low, high, count)
    values = [function(each) for each in at]
    first = next(k for k in range(count - 1) if values[k] * values[k + 1] < 0.0)
    return float(optimize.brentq(function, at[first], at[first + 1], xtol=1e-14))


def _fitted(value, low, high, of):
    """A function of a number between two as an expression `of` it: a polynomial, off by 1e-4 of its range at most."""
    at = np.linspace(low, high, 400)
    wanted = value(at)
    for degree in range(3, 7):
        found = np.polynomial.Polynomial.fit(at, wanted, degree).convert()
        off = np.abs(found(at) - wanted).max() / np.abs(wanted).max()
        if off < 1e-6:
            break
    assert off < 1e-4
    return _polynomial(found.coef.tolist(), f"({of})")


def _hollow_disc():
    return {
        "type": "difference",
        "shapes": [{"type": "disc", "center": [0.0, 0.0], "radius": radius} for radius in (1.0, 0.5)],
    }


def _turning_ring():
    """A free ring of radii 0.5 and 1 whose inner and outer parts turn against each other: J1 and Y1 of k r, whose shear
    goes with J2 and Y2, which is none at both edges."""
    shear = lambda k: special.jv(2, 0.5 * k) * special.yv(2, k) - special.jv(2, k) * special.yv(2, 0.5 * k)  # noqa: E731
    k = _lowest(shear, 1.0, 12.0)
    value = lambda r: special.yv(2, k) * special.jv(1, k * r) - special.jv(2, k) * special.yv(1, k * r)  # noqa: E731
    text = _fitted(lambda r: value(r) / r, 0.5, 1.0, "sqrt(x*x+y*y)")
    omega = k * math.sqrt(SHEAR)
    scene = _scene(2, _hollow_disc(), 1.0 / 12, form="stress-points", end=3.0 * math.pi / omega, material=_elastic(RATIO),
                   body={"surface": "fitted", "velocity": [f"-{SMALL}*y*{text}", f"{SMALL}*x*{text}"]},
                   probes=_probe([0.9, 0.0], "velocity_y"))  # fmt: skip
    exact = {"p.velocity_y": lambda t: SMALL * value(0.9) * np.cos(omega * t)}
    return Case("turning ring, fitted", "fitted", scene, exact, 1e7, tolerances=FINER)


def _second_breathing():
    """The second breathing mode of a free disc in plane strain, J1(k r), with a ring that does not move between."""
    soft = (1.0 - 2.0 * RATIO) / (1.0 - RATIO)  # 2 mu/(lambda + 2 mu)
    k = _lowest(lambda k: k * special.jv(0, k) - soft * special.jv(1, k), 3.0, 8.0)
    text = _fitted(lambda q: special.jv(1, k * np.sqrt(q)) / np.sqrt(q), 1e-6, 1.0, "x*x+y*y")
    omega = k * math.sqrt((1.0 - RATIO) / ((1.0 + RATIO) * (1.0 - 2.0 * RATIO)))
    scene = _scene(2, {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, 2.0 / 12, form="stress-points", state="strain",
                   end=3.0 * math.pi / omega, material=_elastic(RATIO),
                   body={"surface": "fitted", "velocity": [f"{SMALL}*x*{text}", f"{SMALL}*y*{text}"]},
                   probes=_probe([0.3, 0.0], "velocity_x"))  # fmt: skip
    exact = {"p.velocity_x": lambda t: SMALL * float(special.jv(1, 0.3 * k)) * np.cos(omega * t)}
    return Case("second breathing of a disc, fitted", "fitted", scene, exact, 1e7, tolerances=FINER)


def _wine_glass():
    """The mode of a free disc, plane stress, that makes an ellipse of it to and fro: u = grad phi + rot psi with
    phi = A J2(k_p r) cos 2 theta, psi = B J2(k_s r) sin 2 theta and no traction on the edge (Love 1927, article 246)."""
    n, plane = 2, 1.0 / (1.0 - RATIO**2)

    def tractions(omega):
        """Of the radius and along the edge, for A and B, (2, 2)."""
        a, b = omega / math.sqrt(plane), omega / math.sqrt(SHEAR)
        j = [[special.jvp(n, k, m) * k**m for m in range(3)] for k in (a, b)]
        radial = [j[0][1], n * j[1][0]], [j[0][2], n * (j[1][1] - j[1][0])]  # u_r and its derivative
        around = [-n * j[0][0], -j[1][1]], [-n * (j[0][1] - j[0][0]), -j[1][2]]
        hoop = [radial[0][m] + n * around[0][m] for m in range(2)]
        normal = [plane * (radial[1][m] + RATIO * hoop[m]) for m in range(2)]
        along = [SHEAR * (-n * radial[0][m] + around[1][m] - around[0][m]) for m in range(2)]
        return np.array([normal, along])

    omega = _lowest(lambda omega: float(np.linalg.det(tractions(omega))), 0.3, 4.0)
    normal = tractions(omega)[0]
    parts = (1.0, -normal[0] / normal[1])
    k = omega / math.sqrt(plane), omega / math.sqrt(SHEAR)

    def terms(q):
        """With phi = (x^2 - y^2) F(q) and psi = 2 x y G(q), q = r^2: 2 F + 2 G + 2 q F', and G' - F'."""
        f, g = (p * special.jv(2, a * np.sqrt(q)) / q for p, a in zip(parts, k, strict=True))
        df, dg = (-0.5 * p * a * special.jv(3, a * np.sqrt(q)) / q**1.5 for p, a in zip(parts, k, strict=True))
        return 2.0 * (f + g + q * df), dg - df

    first, other = (_fitted(lambda q, n=n: terms(q)[n], 1e-4, 1.0, "x*x+y*y") for n in range(2))
    u, v = f"x*({first}+4*y*y*{other})", f"-y*({first}+4*x*x*{other})"
    at = 0.6 * float(terms(0.36)[0])
    scene = _scene(2, {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, 2.0 / 12, form="stress-points",
                   end=3.0 * math.pi / omega, material=_elastic(RATIO),
                   body={"surface": "fitted", "velocity": [f"{SMALL}*({u})", f"{SMALL}*({v})"]},
                   probes=_probe([0.6, 0.0], "velocity_x"))  # fmt: skip
    exact = {"p.velocity_x": lambda t: SMALL * at * np.cos(omega * t)}
    return Case("disc to an ellipse, fitted", "fitted", scene, exact, 1e7, tolerances=FINER)


def _hollow_sphere():
    """The breathing mode of a hollow sphere of radii 0.6 and 1: j1 and y1 of k r without a traction on either side."""
    stiff = (1.0 - RATIO) / ((1.0 + RATIO) * (1.0 - 2.0 * RATIO))

    def traction(function, k, r):
        u, slope = function(1, k * r), k * function(1, k * r, derivative=True)
        return stiff * slope + 2.0 * (stiff - 2.0 * SHEAR) * u / r

    def both(k):
        return [
            [traction(function, k, r) for function in (special.spherical_jn, special.spherical_yn)] for r in (0.6, 1.0)
        ]

    k = _lowest(lambda k: float(np.linalg.det(both(k))), 0.3, 6.0)
    outer = both(k)[1]
    part = -outer[0] / outer[1]
    value = lambda r: special.spherical_jn(1, k * r) + part * special.spherical_yn(1, k * r)  # noqa: E731
    text = _fitted(lambda r: value(r) / r, 0.6, 1.0, "sqrt(x*x+y*y+z*z)")
    omega = k * math.sqrt(stiff)
    shells = [{"type": "sphere", "center": [0.0] * 3, "radius": radius} for radius in (1.0, 0.6)]
    scene = _scene(3, {"type": "difference", "shapes": shells}, 0.09, form="stress-points", end=3.0 * math.pi / omega,
                   material=_elastic(RATIO), body={"surface": "fitted", "velocity": [f"{SMALL}*{axis}*{text}" for axis in "xyz"]},
                   probes=_probe([0.8, 0.0, 0.0], "velocity_x"))  # fmt: skip
    exact = {"p.velocity_x": lambda t: SMALL * float(value(0.8)) * np.cos(omega * t)}
    return Case("breathing hollow sphere, fitted", "fitted", scene, exact, 6e7)


def _twisted_sphere():
    """A free sphere whose halves turn against each other: j2(k r) sin cos of the angle to the axis, around it, with
    k j2'(k) = j2(k), which is no shear on its surface (Lamb 1882, first class)."""
    j2 = special.spherical_jn
    k = _lowest(lambda k: k * j2(2, k, derivative=True) - j2(2, k), 1.0, 4.0)
    value = lambda q: j2(2, k * np.sqrt(q)) / q  # noqa: E731
    text = _fitted(value, 1e-6, 1.0, "x*x+y*y+z*z")
    omega = k * math.sqrt(SHEAR)
    scene = _scene(3, {"type": "sphere", "center": [0.0] * 3, "radius": 1.0}, 2.0 / 12, form="stress-points",
                   end=3.0 * math.pi / omega, material=_elastic(RATIO),
                   body={"surface": "fitted", "velocity": [f"-{SMALL}*y*z*{text}", f"{SMALL}*x*z*{text}", "0"]},
                   probes=_probe([0.5, 0.0, 0.5], "velocity_y"))  # fmt: skip
    exact = {"p.velocity_y": lambda t: SMALL * 0.25 * float(value(0.5)) * np.cos(omega * t)}
    return Case("twisted sphere, fitted", "fitted", scene, exact, 2e7)


def _round_bar():
    """A round bar of no Poisson's ratio that vibrates along itself, between free ends."""
    length = 2.0
    omega = math.pi / length
    scene = _scene(3, {"type": "cylinder", "from": [0.0] * 3, "to": [0.0, 0.0, length], "radius": 0.5}, 1.0 / 8,
                   form="stress-points", end=3.0 * math.pi / omega, material=_elastic(0.0),
                   body={"surface": "fitted", "velocity": ["0", "0", f"{SMALL}*cos({omega!r}*z)"]}, probes=_probe([0.25, 0.0, 0.5], "velocity_z"))  # fmt: skip
    exact = {"p.velocity_z": lambda t: SMALL * math.cos(0.5 * omega) * np.cos(omega * t)}
    return Case("round bar along itself, fitted", "fitted", scene, exact, 2e7)


KNOWN: list[Callable[[], Case]] = [
    lambda: _disc("breathing disc, fitted", "fitted", "fitted", 2.0 / 12, 8e6),
    lambda: _disc("breathing disc, in stairs", "stairs", "stairs", 2.0 / 12, 8e6),
    _sphere,
    _torsion,
]
FRESH: list[Callable[[], Case]] = [_annulus, _turning]
ROUND: list[Callable[[], Case]] = [
    _turning_ring,
    _second_breathing,
    _wine_glass,
    _hollow_sphere,
    _twisted_sphere,
    _round_bar,
]
