"""The bars that integrators are tried on."""

# pyright: strict

from collections.abc import Mapping

from wsph.scene.scene import Scene

HELD_ENDS = [{"body": "bar", "face": face, "fixed": ["x"]} for face in ("-x", "+x")]

AMPLITUDE = 0.01


def bar(
    integrator: str | Mapping[str, object],
    *,
    end: float,
    courant: float,
    cells: int = 20,
    precision: str = "f64",
    formulation: str | None = None,
    material: Mapping[str, object] | None = None,
    body: Mapping[str, object] | None = None,
    **tables: object,
) -> Scene:
    """A bar of length 1 m, rho = 1 kg/m3, E = 1 Pa, so c = 1 m/s, for a time `end` [s]. `material` are keys of another
    material of that E and rho, `body` further keys of the body, `tables` other tables of the scene."""
    run = {
        "integrator": integrator if isinstance(integrator, str) else dict(integrator),
        "end": end,
        "cfl": courant,
        "precision": precision,
        "guard": "off",
        "device": "cpu",
        **({"formulation": formulation} if formulation else {}),
    }
    law = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.0}
    made = {
        "name": "bar",
        "shape": {"type": "box", "min": [0.0], "max": [1.0]},
        "spacing": 1.0 / cells,
        "state": "stress",
        "material": law | dict(material or {}),
        **(body or {}),
    }
    return Scene(schema=1, dim=1, run=run, bodies=[made], stop={"energy": 1e9}, **tables)


def vibrating_bar(
    integrator: str | Mapping[str, object],
    *,
    cells: int = 20,
    courant: float = 0.2,
    precision: str = "f64",
    periods: float = 0.25,
    amplitude: float = AMPLITUDE,
    material: Mapping[str, object] | None = None,
    formulation: str | None = None,
    **body: object,
) -> Scene:
    """A bar of length 1 m held at both ends, started in its first mode, for `periods` of it: smooth, with a closed form.

    v = a sin(pi x) cos(pi c t), stress = rho c a cos(pi x) sin(pi c t), a = `amplitude` [m/s] (0.01 is a strain that large-
    deformation methods take for small, and no shock forms), c = 1 m/s, rho = 1 kg/m3, E = 1 Pa. `material` are keys of
    another material of that E and rho, `body` further keys of the body.
    """
    return bar(
        integrator,
        end=2.0 * periods,
        courant=courant,
        cells=cells,
        precision=precision,
        formulation=formulation,
        material=material,
        body={"velocity": [f"{amplitude}*sin(pi*x)"], **body},
        title="vibrating bar",
        boundary=HELD_ENDS,
    )
