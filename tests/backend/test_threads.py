"""A team of threads: who does which part of a launch, where they meet, and the cores they take and give back."""

import os
from functools import partial

import pytest
import warp as wp

from wsph.backend import launch, threads
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel


def test_threads_meet_after_every_launch_that_they_share(monkeypatch: pytest.MonkeyPatch) -> None:
    @kernel(ranged=True)
    def ranged(first: int):
        pass

    @kernel()
    def whole(n: int):
        pass

    seen: list[str] = []
    found = threads.ThreadTeam(2)
    monkeypatch.setattr(found, "_meet", lambda number: seen.append("meet"))

    def note(kernel: wp.Kernel, n: int, inputs: list, **_: object) -> None:
        seen.append(f"{kernel.key.split('_')[-1]} {inputs[0]}+{n}")

    monkeypatch.setattr(launch.wp, "launch", note)
    launches = [launch.Launch(kernel, 9, [], [], "cpu") for kernel in (whole, ranged)]
    alone, ranges, pieces = threads.Sharing.ALONE, threads.Sharing.RANGES, threads.Sharing.PIECES
    assert [threads.share(launches[1], seconds) for seconds in (1e-6, 1e-4, 1.0)] == [alone, ranges, pieces]
    assert threads.share(launches[0], 1.0) is alone
    launches[0].inputs.append(0)
    plan = [(launches[k], (alone, ranges)[k]) for k in (0, 1, 1, 0, 0)]
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


def test_threads_do_not_meet_between_parts_that_do_not_take_of_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    @kernel(ranged=True)
    def ranged(first: int):
        pass

    clock, seen = Clock(1.0, "cpu"), list[str]()

    def part(*counts: int) -> None:
        for n in counts:
            clock.launch(ranged, n, [], [])

    def step() -> None:
        clock.apart([partial(part, 1, 2), partial(part, 3), partial(part, 4)])
        clock.apart([partial(part, 5), partial(part, 6)])
        clock.apart([partial(part, 7)])

    launches = clock.launches(step)
    found = threads.ThreadTeam(2)
    monkeypatch.setattr(found, "_meet", lambda number: seen.append("meet"))
    monkeypatch.setattr(launch.wp, "launch", lambda kernel, n, **_: seen.append(str(n)))
    for seconds, expected in (
        (1e-4, ["1 2 4 meet 5 meet 3 meet", "3 meet 6 meet 4 meet"]),
        (1.5e-5, ["1 2 4 meet 5 meet 7 meet", "3 meet 6 meet meet"]),
        (2e-6, ["1 2 3 4 5 6 7 meet", "meet"]),
    ):
        together = threads._together(launches, [seconds] * len(launches))
        plan = [(each, threads.share(each, time)) for each, time in zip(launches, together, strict=True)]
        for number, words in enumerate(expected):
            seen.clear()
            found._part(plan, number)
            assert " ".join(seen) == words
    found.dismiss()


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="no affinity here")
def test_the_caller_gets_its_cores_back() -> None:
    before = os.sched_getaffinity(0)
    found = threads.ThreadTeam(2)
    with found.at_work():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before
    found.dismiss()
