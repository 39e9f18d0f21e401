"""Contact of a body that breaks while it is in contact."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.contact.surfaces.test_breaking import LINKS, tear
from wsph.contact.meeting.meeting import Meeting
from wsph.contact.surfaces.coupling import BREAKING, Surfaces
from wsph.simulation.checkpoint import read
from wsph.simulation.compose import compose


@pytest.mark.filterwarnings("ignore:body .* cracks of links")
def test_a_crack_elsewhere_leaves_a_contact_as_it_is() -> None:
    """Pressed on one side, torn from below: surfaces are remade, contacts go on with what they remember, and the new banks
    of the crack may be met."""
    h = 0.125
    one = scenes.body(scenes.cube(2), h, "a", state="strain", material=scenes.material("jaumann"), **LINKS)
    other = scenes.body(scenes.box((1.0, 1.5), (0.0, 1.0)), h, "b", state="strain")
    contact = [{"between": ["a", "b"], "stiffness": 1.0, "friction": 0.3, "damping": 0.0}]
    run = {"formulation": "total-lagrangian", "cfl": 0.2, "end": 1.0}
    made = compose(scenes.scene(one, other, run=run, contact=contact))
    assert made.joint is not None
    coupling, joint = made.joint.couplings[0], made.joint
    assert isinstance(coupling, Surfaces)
    law = coupling.laws[0]
    assert isinstance(law, Meeting)
    joint.start()
    states, rates = joint.state.parts, joint.new().parts
    for k in range(1, 5):
        u = np.zeros((made.bodies[1].system.count, 2))
        u[:] = [-0.02 * k, 0.02 * k]
        states["b"].write("displacement", u)
        coupling.push(states, rates)
        coupling.close(states, fresh=True)
    force, stored, lost = law.force(coupling.surfaces["b"]), law.stored, law.dissipated
    assert force[0] > 0.05
    assert stored > 0.0
    assert lost > 0.0
    before = coupling.surfaces["a"].n
    assert not coupling.follow()
    tear(made.bodies[0].system, 0.5)
    # What has broken is looked for every few steps.
    assert any(coupling.follow() for _ in range(BREAKING + 1))
    assert coupling.surfaces["a"].n > before
    assert law.stored == pytest.approx(stored, rel=1e-14)
    assert law.dissipated == pytest.approx(lost, rel=1e-14)
    coupling.push(states, rates)
    assert law.force(coupling.surfaces["b"]) == pytest.approx(force, rel=1e-6)


def test_a_run_goes_on_from_a_broken_surface(tmp_path: Path) -> None:
    """A strip that tears apart on a block: a checkpoint from after cells have died has their surface, and the same bits
    follow."""
    strip = scenes.body(scenes.box(1.0, 0.25), 0.0625, "strip", velocity=["0.3*(x - 0.5)", -0.05],
                        phase_field={"fracture_energy": 2e-3, "length": 0.125})  # fmt: skip
    block = scenes.body(scenes.box((0.2, 0.8), (-0.31, -0.01)), 0.06, "block")
    made = scenes.scene(
        strip,
        block,
        run={"end": 3.0, "cfl": 0.1},
        contact=[{"between": ["strip", "block"], "friction": 0.2}, {"self": "strip"}],
        tools=[{"name": "floor", "shape": {"type": "plane", "point": [0.0, -0.31], "normal": [0.0, 1.0]}, "against": ["block"]}],
        checkpoint={"every": 7},
        stop={"energy": 1.0},
    )  # fmt: skip
    straight = wsph.run(made, throw=False)
    assert straight.summary["fracture"]["strip"]["broken"] > 4

    def until(step: int, steps: int, time: float) -> None:
        if time > 2.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        wsph.run(made, tmp_path / "out", progress=until)
    _, kept = read(max((tmp_path / "out" / "checkpoints").iterdir()))
    assert kept["surface.strip.alive"].min() == 0
    resumed = wsph.run(made, tmp_path / "out", resume=True, throw=False)
    for name, values in straight.particles.items():
        np.testing.assert_array_equal(values, resumed.particles[name])
