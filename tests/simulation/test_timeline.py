"""Records: at the steps that a cadence names, whatever blocks the steps are run in."""

import numpy as np

import wsph


def test_records_are_the_first_state_at_or_after_their_time(shock_bar: wsph.Scene) -> None:
    dt = 5e-5
    probe = {"name": "p", "at": [[1.0]], "fields": ["velocity_x"], "every": "0.12 ms"}
    result = wsph.run(
        shock_bar.with_(dt=dt, end="1.03 ms", probes=[probe, probe | {"name": "q", "every": 7}], output={"history": 5})
    )
    assert result.summary["steps"] == 21  # ceil(1.03 ms / dt)
    expected = sorted({0, 21} | {int(np.ceil(k * 1.2e-4 / dt - 1e-9)) for k in range(1, 9)})
    assert np.rint(result.probes["p"]["time"] / dt).astype(int).tolist() == expected
    assert np.rint(result.probes["q"]["time"] / dt).astype(int).tolist() == [0, 7, 14, 21]
    assert result.history["step"].tolist() == [0, 5, 10, 15, 20, 21]


def test_every_step_means_every_step_across_blocks(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(end="0.15 s"))  # 3000 steps: three rings
    times = result.probes["fixed-end"]["time"]
    np.testing.assert_allclose(np.diff(times), 5e-5, rtol=1e-9)
    assert len(times) == 3001


def test_the_cadence_of_records_does_not_change_the_bits(shock_bar: wsph.Scene) -> None:
    scene = shock_bar.with_(cfl=0.7)
    finals = [
        wsph.run(scene.with_(output={"history": every, "every": frames})).particles
        for every, frames in ((1, None), (13, "0.7 ms"), (1000, 17))
    ]
    for other in finals[1:]:
        for name, values in finals[0].items():
            assert np.array_equal(values, other[name]), name


def test_a_cadence_may_be_longer_than_any_run(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(end="1 ms", output={"every": 1e308, "history": 2**52}))
    assert result.history["step"].tolist() == [0, 20]
