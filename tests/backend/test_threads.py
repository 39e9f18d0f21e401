"""A team of threads: who does which part of a launch, where they meet, and the cores they take and give back."""

import os

import pytest
import warp as wp

from wsph.backend import launch, threads


def test_threads_meet_after_every_launch_that_they_share(monkeypatch: pytest.MonkeyPatch) -> None:
    @wp.kernel(enable_backward=False)
    def ranged(first: int):
        pass

    @wp.kernel(enable_backward=False)
    def whole(n: int):
        pass

    seen: list[str] = []
    found = threads.ThreadTeam(2)
    monkeypatch.setattr(found, "_meet", lambda number: seen.append("meet"))

    def note(kernel: wp.Kernel, n: int, inputs: list, **_: object) -> None:
        seen.append(f"{kernel.key.split('_')[-1]} {inputs[0]}+{n}")

    monkeypatch.setattr(launch.wp, "launch", note)
    launches = [launch.Launch(kernel, 9, [], [], "cpu") for kernel in (whole, ranged)]
    assert [threads.share(launches[1], seconds) for seconds in (1e-6, 1e-4, 1.0)] == list(threads.Sharing)
    assert threads.share(launches[0], 1.0) is threads.Sharing.ALONE
    launches[0].inputs.append(0)
    plan = [(launches[k], k == 1) for k in (0, 1, 1, 0, 0)]
    found._part(plan, 0)
    assert seen == ["whole 0+9", "meet", "ranged 0+4", "meet", "ranged 0+4", "meet", "whole 0+9", "whole 0+9", "meet"]
    seen.clear()
    found._part(plan, 1)
    assert seen == ["meet", "ranged 4+5", "meet", "ranged 4+5", "meet", "meet"]
    seen.clear()
    monkeypatch.setattr(threads, "PIECE_SHARE", 0.5)
    found._pieces(launches[1], 1.0)
    assert seen == [f"ranged {each}" for each in ("0+2", "2+1", "3+1", "4+2", "6+1", "7+1", "8+1")]
    found.dismiss()


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="no affinity here")
def test_the_caller_gets_its_cores_back() -> None:
    before = os.sched_getaffinity(0)
    found = threads.ThreadTeam(2)
    with found.at_work():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before
    found.dismiss()
