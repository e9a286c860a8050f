"""A process of a run stands still for seconds.

A choice of `python -m tests.support.stalls`, which stops each of them, for as long as is asked.
"""

from __future__ import annotations

import pytest

from tests.support.stalls import run

pytestmark = [
    pytest.mark.verifies(what="Record: whether it is the flight"),
    pytest.mark.slow(seconds=15),
]


def test_seven_seconds_of_silence_leave_the_same_log():
    """Meanwhile the flight software announces itself twenty times."""
    calm, stopped = (run("emulator", seconds, "lockstep") for seconds in (0.0, 7.0))
    assert (calm.status, stopped.status) == (0, 0)
    assert stopped.sha == calm.sha


@pytest.mark.parametrize("who", ["supervisor", "flight"])
def test_no_fix_is_taken_for_another_epochs(who):
    """Two seconds at x300 are 600 epochs, of which a frame can tell sixteen."""
    result = run(who, 2.0, "x300")
    assert result.honest
    assert result.late > 0 and "two epochs late or more" in result.words
    assert (result.status == 0) == (result.recorded == result.flown)
