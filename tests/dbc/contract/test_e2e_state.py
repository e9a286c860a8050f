"""The state machine of streams: another implementation's vectors, and the specification read again."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from gnss_hil.dbc.common.protection import LONGEST_WINDOW, Protection
from gnss_hil.dbc.contract.e2e_state import State, Status, StreamStates, advance, limits, no_data
from tests.support.outside import data_file

LETTERS = {"O": Status.OK, "R": Status.REPEATED, "W": Status.WRONG_SEQUENCE, "E": Status.ERROR,
           "N": Status.NO_NEW_DATA}  # fmt: skip
STATES = {"N": State.NODATA, "I": State.INIT, "V": State.VALID, "X": State.INVALID}
KEYS = (
    "window_size",
    *(
        f"{limit}_state_{state}"
        for state in ("init", "valid", "invalid")
        for limit in ("min_ok", "max_error")
    ),
)
"""Parameters in the order of the vectors."""

pytestmark = pytest.mark.verifies(
    "dbc/contract/e2e_state.py",
    what="State machine of protected streams",
    by="500 sequences of 60 checks by an implementation of AUTOSAR 4.3.0; the specification read again",
    status="validated",
)


def played(protection: Protection, status: np.ndarray) -> np.ndarray:
    """(n, k) states after each of k checks of n streams, together."""
    states, found = no_data(len(status)), []
    for column in status.T:
        states = advance(limits(protection), states, column)
        found.append(states.state)
    return np.array(found).T


def coded(words: list[str], table: dict) -> np.ndarray:
    return np.array([[table[letter] for letter in word] for word in words], np.uint8)


def test_vectors_of_another_implementation():
    """All sequences of a set of limits are streams of one machine."""
    rows: dict[str, list] = {}
    for line in data_file("can/e2e_state_machine_vectors.txt").read_text("utf-8").splitlines():
        if not line.startswith("#"):
            parameters, status, states = (part.strip() for part in line.split("|"))
            rows.setdefault(parameters, []).append((status, states))
    assert sum(map(len, rows.values())) == 500
    for parameters, sequences in rows.items():
        protection = Protection(**dict(zip(KEYS, map(int, parameters.split()), strict=True)))
        status, expected = zip(*sequences, strict=True)
        assert all(map(len, status)) and set(map(len, status)) == {60}
        assert np.array_equal(played(protection, coded(status, LETTERS)), coded(expected, STATES)), parameters


class Machine:
    """E2E_SMCheck for one stream, as PRS E2E Protocol has it: a ring of statuses, counted anew each time."""

    def __init__(self, p: Protection):
        self.p, self.state = p, "NODATA"
        self.window = deque(["NOTAVAILABLE"] * p.window_size, maxlen=p.window_size)

    def check(self, status: Status) -> str:
        if self.state == "NODATA":
            if status not in (Status.ERROR, Status.NO_NEW_DATA):
                self.state = "INIT"
            return self.state
        self.window.append(status)
        ok = sum(each == Status.OK for each in self.window)
        errors = sum(each == Status.ERROR for each in self.window)
        p = self.p
        if self.state == "INIT":
            if errors > p.max_error_state_init:
                self.state = "INVALID"
            elif ok >= p.min_ok_state_init:
                self.state = "VALID"
        elif self.state == "VALID":
            if errors > p.max_error_state_valid or ok < p.min_ok_state_valid:
                self.state = "INVALID"
        elif errors <= p.max_error_state_invalid and ok >= p.min_ok_state_invalid:
            self.state = "VALID"
        return self.state


def drawn(rng: np.random.Generator) -> Protection:
    """Any limits that AUTOSAR's constraints allow."""
    window = int(rng.choice([1, 2, 3, 7, 31, 32, 33, 63, LONGEST_WINDOW]))
    least = np.sort(rng.integers(1, window + 1, 3))
    most = [int(rng.integers(0, window - each + 1)) for each in least]
    errors = np.minimum.accumulate(most)
    return Protection(
        window_size=window,
        min_ok_state_valid=least[0].item(), min_ok_state_init=least[1].item(),
        min_ok_state_invalid=least[2].item(),
        max_error_state_valid=errors[0].item(), max_error_state_init=errors[1].item(),
        max_error_state_invalid=errors[2].item(),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(40))
def test_specification_read_again(seed):
    """Sixteen streams a time under random limits, now well, now badly received; some are not checked."""
    rng = np.random.default_rng(seed)
    protection = drawn(rng)
    status = np.empty((16, 400), np.uint8)
    for stream in range(16):
        at = 0
        while at < 400:
            stretch = int(rng.integers(1, 90))
            good = rng.choice([0.02, 0.4, 0.9, 1.0])
            some = rng.choice(sorted(set(Status) - {Status.OK}), stretch)
            status[stream, at : at + stretch] = np.where(rng.random(stretch) < good, 0, some)[: 400 - at]
            at += stretch
    found = played(protection, status)
    seen = set()
    for stream in range(16):
        machine = Machine(protection)
        for k, each in enumerate(map(Status, status[stream].tolist())):
            state = machine.state if each == Status.NOT_AVAILABLE else machine.check(each)
            assert State(int(found[stream, k])).name == state
            seen.add(state)
    assert {"INIT", "INVALID"} <= seen


def test_what_is_not_checked_stays_as_it_is():
    rng = np.random.default_rng(1)
    states = StreamStates(
        rng.choice(list(State), 50).astype(np.uint8),
        rng.integers(0, 1 << 10, 50).astype(np.uint64),
        rng.integers(0, 1 << 10, 50).astype(np.uint64),
    )
    for stream in (states.ok, states.error):
        stream[states.state == State.NODATA] = 0
    before = [part.copy() for part in (states.state, states.ok, states.error)]
    after = advance(limits(Protection()), states, np.full(50, Status.NOT_AVAILABLE, np.uint8))
    assert after is states
    advance(limits(Protection()), states, np.full(50, Status.ERROR, np.uint8))
    assert all(map(np.array_equal, before, (states.state, states.ok, states.error))), (
        "arguments are not modified"
    )


@pytest.mark.parametrize("window", [1, 5, 10, LONGEST_WINDOW])
def test_default_limits_use_every_stream_that_was_just_good(window):
    """One good check is enough in every state, errors never too many: what passes its own check is used."""
    rng = np.random.default_rng(window)
    protection = Protection(
        window_size=window, max_error_state_valid=window - 1, max_error_state_init=window - 1,
        max_error_state_invalid=window - 1,
    )  # fmt: skip
    assert window != 10 or protection == Protection()
    status = rng.choice(list(Status), (200, 300), p=[0.1, 0.1, 0.1, 0.4, 0.1, 0.2]).astype(np.uint8)
    found, usable = played(protection, status), limits(protection).usable
    assert usable[found[status == Status.OK]].all()
    assert not usable[found].all()


def test_nothing_is_used_before_it_is_valid_if_the_letter_is_wanted():
    usable = limits(Protection(use_state_init=False)).usable
    assert [state.name for state in State if usable[state]] == ["VALID"]
    assert [state.name for state in State if limits(Protection()).usable[state]] == ["VALID", "INIT"]
