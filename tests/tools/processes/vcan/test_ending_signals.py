"""Signals that ask to end: raised once, and only where they are waited for."""

from __future__ import annotations

import signal

import pytest

from gnss_hil.tools.processes.vcan.ending_signals import Ended, EndingSignals

pytestmark = pytest.mark.verifies(
    "tools/processes/vcan/ending_signals.py",
    what="Signals that ask to end",
    by="signals raised at every moment: before, while it waits, while it cleans up",
    status="modelled",
)


def test_a_signal_is_raised_once_and_only_where_it_is_waited_for():
    before = signal.getsignal(signal.SIGTERM)
    with EndingSignals() as signals:
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Ended) as ended, signals.raised():
            pytest.fail("the signal that came before is not raised")
        assert ended.value.args == (signal.SIGTERM,)
    with EndingSignals() as signals:
        with pytest.raises(Ended) as ended, signals.raised():
            try:
                signal.raise_signal(signal.SIGHUP)
            finally:
                signal.raise_signal(signal.SIGTERM)  # while it cleans up
        assert ended.value.args == (signal.SIGHUP,)
    assert signal.getsignal(signal.SIGTERM) is before


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with EndingSignals() as signals, signals.raised():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)
