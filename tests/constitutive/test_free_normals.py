"""Total laws far from what is linear, where normals are free: the thickness, or the word that there is none."""

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.materials.closed_forms import thinned, total


def moved(law: str, dim: int, speeds: list[str], end: float, form: str = "stress-points") -> wsph.Result:
    """The result of a body every particle of which is driven."""
    drive = [{"body": "b", "where": "x > -1", "velocity": dict(zip("xyz", speeds, strict=False))}]
    run = {"formulation": form, "end": end, "cfl": 0.4}
    return wsph.run(
        scenes.block(
            dim, 2, model=law, state="stress", velocity=speeds, centred=True, run=run, tables={"boundary": drive}
        )
    )


@pytest.mark.parametrize("form", scenes.FORMS)
def test_a_sheet_that_is_sheared_to_three_has_no_stress_across(form: str) -> None:
    result = moved("neo-hookean", 2, ["0.1*y", "0"], 30.0, form)
    F = np.eye(3)
    F[0, 1] = 0.1 * result.time
    right = total("neo-hookean", thinned("neo-hookean", F))
    found = result.particles["stress"][:, [0, 1, 3]]
    assert np.abs(found - [right[0, 0], right[1, 1], right[0, 1]]).max() < 1e-6 * right[0, 0]


@pytest.mark.parametrize("speed", [0.1, -0.03])
def test_a_bar_that_is_pulled_to_four_or_crushed_to_a_tenth(speed: float) -> None:
    result = moved("neo-hookean", 1, [f"{speed}*x"], 30.0)
    F = np.diag([1.0 + speed * result.time, 1.0, 1.0])
    right = total("neo-hookean", thinned("neo-hookean", F, (1, 2)))[0, 0]
    assert result.particles["stress"][:, 0] == pytest.approx(right, rel=1e-5)


@pytest.mark.parametrize("form", scenes.FORMS)
def test_where_every_thickness_has_a_stress_a_run_is_stopped_by_name(form: str) -> None:
    """St Venant-Kirchhoff's sheet is down to nothing at a shear of 1.53."""
    with pytest.raises(wsph.errors.Unstable, match="stress of .*elastic has no thickness without stress across"):
        moved("elastic", 2, ["0.1*y", "0"], 18.0, form)
