"""The channels' state machine, epoch by epoch."""

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.receivers.emulated import channels as c
from gnss_hil.emulator.signal.data_frames import collection_ns

pytestmark = pytest.mark.verifies(
    "emulator/receivers/emulated/channels.py",
    what="Channels, acquisition times, knowledge",
    by="times are parameters; shared by the receivers of a craft",
    status="modelled",
)

S = 1_000_000_000
PACE = c.Pace(1 * S, 3 * S, 12 * S, 24 * S, 7200 * S)
COUNTS = np.array([3, 2])


def tuned(targets):
    fresh = c.fresh_channels(COUNTS)
    return c.retarget(fresh, fresh.commanded, np.array(targets), 0)


def play(channels, knowledge, signals, start_s=0, collection_ns=None):
    """Advance a second at a time; signals: one (m, n) a step. Lock states by step."""
    locks = []
    for second, signal in enumerate(signals, start_s):
        channels, knowledge, begins = c.advance(channels, knowledge, signal, PACE, second * S, collection_ns)
        locks.append((channels.lock.copy(), begins))
    return channels, knowledge, locks


def first_full(locks, where):
    return next((i for i, (lock, _) in enumerate(locks) if lock[where] == c.FULL), None)


def test_missing_channels_are_never_used():
    fresh = c.fresh_channels(COUNTS)
    assert fresh.commanded.tolist() == [[False] * 3, [False, False, True]]


@pytest.mark.parametrize(
    ("warm", "collected_ns", "seconds"),
    [(False, c.NEVER_NS, 36), (True, c.NEVER_NS, 27), (True, -100 * S, 1), (True, -7201 * S, 27)],
)
def test_time_to_measure(warm, collected_ns, seconds):
    """cold + collect, warm + collect, hot; an ephemeris of more than two hours no longer serves."""
    knowledge = c.Knowledge(warm, np.full((1, 4), collected_ns))
    on = np.ones((2, 4), bool)
    _, _, locks = play(tuned([[2, -1, -1], [-1, -1, -1]]), knowledge, [on] * 40)
    assert first_full(locks, (0, 0)) == seconds
    assert [begins[0, 0] for _, begins in locks].index(True) == seconds
    assert sum(begins.sum() for _, begins in locks) == 1


def test_states_on_the_way():
    knowledge = c.Knowledge(True, np.full((1, 4), c.NEVER_NS))
    on = np.ones((2, 4), bool)
    _, _, locks = play(tuned([[2, -1, -1], [-1, -1, -1]]), knowledge, [on] * 30)
    names = [lock[0, 0] for lock, _ in locks]
    assert names == [c.SEARCH] * 3 + [c.BIT_SYNC] * 24 + [c.FULL] * 3
    assert {lock[0, 1] for lock, _ in locks} == {c.IDLE}


def test_receivers_share_what_they_collect():
    knowledge = c.Knowledge(True, np.full((1, 4), c.NEVER_NS))
    signals = [np.array([[0, 0, 1, 0], [0, 0, int(t >= 20), 0]], bool) for t in range(40)]
    _, _, locks = play(tuned([[2, -1, -1], [2, -1, -1]]), knowledge, signals)
    assert first_full(locks, (0, 0)) == 27
    assert first_full(locks, (1, 0)) == 28  # in BIT_SYNC since 22, it need not collect 24 s of its own


def test_receivers_may_keep_what_they_collect_to_themselves():
    knowledge = c.fresh_knowledge(4, holders=2)
    knowledge = c.Knowledge(True, knowledge.collected_ns)
    signals = [np.array([[0, 0, 1, 0], [0, 0, int(t >= 20), 0]], bool) for t in range(60)]
    _, knowledge, locks = play(tuned([[2, -1, -1], [2, -1, -1]]), knowledge, signals)
    assert first_full(locks, (0, 0)) == 27
    assert first_full(locks, (1, 0)) == 46  # in BIT_SYNC since 22, and 24 s of its own
    assert knowledge.collected_ns[:, 2].tolist() == [59 * S, 59 * S]
    assert (knowledge.collected_ns[:, [0, 1, 3]] == c.NEVER_NS).all()


def test_an_ephemeris_takes_as_long_as_its_frames():
    """Held from 3 s on; GPS frames begin with whole half minutes of GPS time: subframe 2 from 6 s on,
    subframe 1 ends at 36 s. GLONASS frames begin with those of UTC, and GPS time 0 is before the
    first leap second: string 2 is under way, 3, 4, and 1 of the next frame are had before it comes
    again and ends at 34 s."""
    knowledge = c.Knowledge(True, np.full((1, 4), c.NEVER_NS))
    system = np.array((satellites.GPS, satellites.GPS, satellites.GLONASS, satellites.GLONASS))

    def by_frames(row, since_ns):
        return collection_ns(system[row], since_ns)

    on = np.ones((2, 4), bool)
    _, _, locks = play(tuned([[1, 2, -1], [-1, -1, -1]]), knowledge, [on] * 60, collection_ns=by_frames)
    assert first_full(locks, (0, 0)) == 36
    assert first_full(locks, (0, 1)) == 34


def test_search_time_runs_only_with_a_signal():
    """Counted from the last epoch without one: 3 s are never reached where every third epoch has none."""
    knowledge = c.Knowledge(True, np.full((1, 4), c.NEVER_NS))
    signals = [np.full((2, 4), t % 3 != 0) for t in range(12)]
    _, _, locks = play(tuned([[2, -1, -1], [-1, -1, -1]]), knowledge, signals)
    assert {lock[0, 0] for lock, _ in locks} == {c.SEARCH}


def test_measuring_keeps_the_ephemeris_new():
    knowledge = c.Knowledge(True, np.zeros((1, 4), np.int64))
    on = np.ones((2, 4), bool)
    _, knowledge, _ = play(tuned([[2, -1, -1], [-1, -1, -1]]), knowledge, [on] * 10)
    assert knowledge.collected_ns.tolist() == [[0, 0, 9 * S, 0]]


def test_slips_count_modulo_sixteen():
    knowledge = c.Knowledge(True, np.zeros((1, 4), np.int64))
    signals = [np.full((2, 4), t % 3 != 0) for t in range(3 * 17)]
    channels, _, locks = play(tuned([[2, -1, -1], [-1, -1, -1]]), knowledge, signals)
    assert sum(begins[0, 0] for _, begins in locks) == 17
    assert channels.slips[0, 0] == 1


def test_retarget_keeps_the_lock_of_a_satellite_that_stays():
    channels = tuned([[2, 1, -1], [0, -1, -1]])
    knowledge = c.Knowledge(True, np.zeros((1, 4), np.int64))
    channels, _, _ = play(channels, knowledge, [np.ones((2, 4), bool)] * 3)
    moved = c.retarget(channels, channels.commanded, np.array([[2, 3, -1], [-1, -1, -1]]), 9 * S)
    assert moved.lock[0].tolist() == [c.FULL, c.SEARCH, c.IDLE]
    assert moved.lock[1, 0] == c.IDLE
    assert moved.since_ns[0, 1] == 9 * S
