"""Signals that ask a run to end, in whatever program it is."""

import signal

import pytest

from wsph.output.interrupts import Interrupts


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1])
def test_a_signal_is_held_and_what_it_meant_before_comes_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with Interrupts() as outer:
        with Interrupts() as inner:
            signal.raise_signal(number)
            assert inner.asked == number
        assert outer.asked == 0
        signal.raise_signal(number)
        assert outer.asked == number
    assert signal.getsignal(number) == before


def test_a_signal_that_is_ignored_or_has_a_meaning_of_the_program_keeps_it() -> None:
    came: list[int] = []
    hup = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    own = signal.signal(signal.SIGUSR1, lambda number, _: came.append(number))
    try:
        with Interrupts() as held:
            signal.raise_signal(signal.SIGUSR1)
            signal.raise_signal(signal.SIGHUP)
            assert held.asked == 0
        assert came == [signal.SIGUSR1]
    finally:
        signal.signal(signal.SIGHUP, hup)
        signal.signal(signal.SIGUSR1, own)
