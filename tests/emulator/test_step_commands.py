"""Commands over the bus: what they do, how they are answered, how long receivers take."""

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract import e2e, frames, screening
from gnss_hil.emulator.receivers.emulated.channels import LOCK
from gnss_hil.emulator.receivers.emulated.commands import RESULT
from gnss_hil.emulator.state import commands_rejected
from tests.support import emulated
from tests.support.emulated import AUTONOMOUS, RELEASE, TRACK, command, sealed

pytestmark = pytest.mark.verifies(
    "emulator/receivers/emulated/commands.py",
    what="Commands and answers",
    by="rules of docs/contract.md",
    status="modelled",
)

ACCEPTED = RESULT["ACCEPTED"]
QUICK = {"hot_s": 0, "warm_s": 0, "cold_s": 0, "ephemeris_s": 0}


def soyuz(**receivers):
    return emulated.craft(factors=emulated.QUIET, receivers={**QUICK, **receivers})


def free_satellites(the_world, epoch, receiver):
    """Names of satellites with a signal at a receiver that it does not track by itself, best C/N0 first."""
    scene = emulated.epoch_at(the_world, epoch)
    sky = scene.sky
    taken = emulated.tracked(emulated.run(the_world, 1)[1][0], receiver).values()
    order = np.argsort(-scene.cn0_dbhz[receiver - 1])
    names = [satellites.name(sky.index[j]) for j in order if scene.signal[receiver - 1, j]]
    return [name for name in names if name not in taken]


def hidden_satellite(the_world):
    scene = emulated.epoch_at(the_world, 0)
    return satellites.name(scene.sky.index[np.argmin(scene.view.ray_height_m)])


def test_track_takes_effect_in_the_next_block_with_its_answer():
    the_world = emulated.world(soyuz())
    name = free_satellites(the_world, 0, 1)[0]
    _, blocks, _ = emulated.run(the_world, 3, {1: sealed(command(1, 2, TRACK, name, transaction=77))})
    assert emulated.answers(blocks[0]) == []
    assert emulated.answers(blocks[1]) == [(1, 2, ACCEPTED, 77)]
    assert emulated.tracked(blocks[1], 1)[2] == name
    assert emulated.answers(blocks[2]) == []


def test_release_idles_a_channel_until_it_is_given_back():
    the_world = emulated.world(soyuz())
    orders = emulated.orders({1: [command(3, 4, RELEASE)], 4: [command(3, 4, AUTONOMOUS)]})
    _, blocks, _ = emulated.run(the_world, 5, orders)
    assert 4 in emulated.tracked(blocks[0], 3)
    assert all(4 not in emulated.tracked(blocks[k], 3) for k in (1, 2, 3))
    assert 4 in emulated.tracked(blocks[4], 3)
    states = [emulated.decode(b, "STATUS")["state"].tolist() for b in blocks]
    assert states[0] == [2, 2, 2, 2]
    assert states[1] == [2, 2, 3, 2]
    assert states[4] == [2, 2, 2, 2]


@pytest.mark.parametrize(
    ("order", "result"),
    [
        (lambda w: command(1, 6, TRACK, "G01"), "NO_SUCH_CHANNEL"),
        (lambda w: command(1, 31, RELEASE), "NO_SUCH_CHANNEL"),
        (lambda w: command(1, 0, 3, "G01"), "BAD_ACTION"),
        (lambda w: command(1, 0, TRACK, "G33"), "NO_SUCH_SATELLITE"),
        (lambda w: command(1, 0, TRACK, "R25"), "NO_SUCH_SATELLITE"),
        (lambda w: command(1, 0, TRACK, "E01", signal=7), "NO_SUCH_SATELLITE"),
        (lambda w: command(1, 0, TRACK), "NO_SUCH_SATELLITE"),
        (lambda w: command(1, 0, TRACK, "G30"), "NOT_IN_ALMANAC"),
        (lambda w: command(1, 0, TRACK, hidden_satellite(w)), "BEHIND_EARTH"),
        (lambda w: command(1, 0, TRACK, "G01", signal=1), "NO_SUCH_SIGNAL"),
        (lambda w: command(1, 0, TRACK, "R01", signal=0), "NO_SUCH_SIGNAL"),
    ],
)
def test_the_impossible_is_refused_and_changes_nothing(order, result):
    the_world = emulated.world(soyuz())
    _, blocks, _ = emulated.run(the_world, 2, {1: sealed(order(the_world))})
    assert [a[2] for a in emulated.answers(blocks[1])] == [RESULT[result]]
    assert emulated.tracked(blocks[1], 1) == emulated.tracked(blocks[0], 1)


def test_a_cold_unit_cannot_tell_what_the_earth_hides_and_waits():
    the_world = emulated.world(soyuz(cold_s=4))
    hidden = hidden_satellite(the_world)
    orders = emulated.orders({epoch: [command(1, 0, TRACK, hidden)] for epoch in (1, 6)})
    states, blocks, _ = emulated.run(the_world, 7, orders)
    assert [state.units[0].knowledge.warm for state in states] == [False] * 4 + [True] * 3
    assert [emulated.answers(blocks[epoch])[0][2] for epoch in (1, 6)] == [ACCEPTED, RESULT["BEHIND_EARTH"]]
    channels = states[-1].units[0].channels
    assert channels.target[0, 0] == the_world.row_of[satellites.parse(hidden)]
    assert channels.lock[0, 0] == LOCK["SEARCH"]


def test_unhealthy_satellites_are_refused_and_left_alone():
    the_world = emulated.world(soyuz())
    sick = next(iter(emulated.tracked(emulated.run(the_world, 1)[1][0], 1).values()))

    class Sky:
        """The world's sky, one satellite of it broadcasting that it is unhealthy."""

        index = the_world.sky.index

        @staticmethod
        def over(t_ns):
            state = the_world.sky.over(t_ns)
            healthy = state.broadcast.healthy & (state.index != satellites.parse(sick))
            return replace(state, broadcast=replace(state.broadcast, healthy=healthy))

    changed = emulated.under(the_world, sky=Sky)
    _, blocks, _ = emulated.run(changed, 2, {1: sealed(command(1, 0, TRACK, sick))})
    assert [a[2] for a in emulated.answers(blocks[1])] == [RESULT["UNHEALTHY"]]
    assert all(sick not in emulated.tracked(blocks[1], r).values() for r in (1, 2, 3, 4))
    # Already under command when it falls ill, it is measured on, and the bus says so.
    _, before, _ = states = emulated.run(the_world, 2, {1: sealed(command(1, 0, TRACK, sick))})
    _, after, _ = emulated.run(changed, 1, state=states[0][1], first=2)
    assert emulated.tracked(before[1], 1)[0] == emulated.tracked(after[0], 1)[0] == sick
    seen = emulated.channels(after[0])
    assert set(seen["health"][seen["sat"] == satellites.parse(sick)]) == {1}


def test_one_satellite_once_in_a_receiver_but_on_several_antennas():
    the_world = emulated.world(soyuz())
    name = free_satellites(the_world, 0, 1)[0]
    orders = sealed(command(1, 0, TRACK, name), command(1, 1, TRACK, name), command(2, 0, TRACK, name))
    _, blocks, _ = emulated.run(the_world, 2, {1: orders})
    results = [a[2] for a in emulated.answers(blocks[1])]
    assert results == [ACCEPTED, RESULT["ALREADY_TRACKED_HERE"], ACCEPTED]


def test_a_command_goes_before_a_channel_that_searches_by_itself():
    the_world = emulated.world(soyuz())
    _, before, _ = emulated.run(the_world, 1)
    own = emulated.tracked(before[0], 1)
    _, blocks, _ = emulated.run(the_world, 2, {1: sealed(command(1, 0, TRACK, own[3]))})
    assert emulated.answers(blocks[1])[0][2] == ACCEPTED
    after = emulated.tracked(blocks[1], 1)
    assert after[0] == own[3]
    assert after.get(3) != own[3]


def test_releases_go_before_tracks():
    """Moving a satellite to another channel in one block: the order of the two frames does not matter."""
    the_world = emulated.world(soyuz())
    name = free_satellites(the_world, 0, 1)[0]
    for moves in (
        [command(1, 5, TRACK, name), command(1, 0, RELEASE)],
        [command(1, 0, RELEASE), command(1, 5, TRACK, name)],
    ):
        _, blocks, _ = emulated.run(
            the_world, 3, emulated.orders({1: [command(1, 0, TRACK, name)], 2: moves})
        )
        assert [a[2] for a in emulated.answers(blocks[2])] == [ACCEPTED, ACCEPTED]
        assert [a[1] for a in emulated.answers(blocks[2])] == [int(m.data[0, 2] & 31) for m in moves]
        assert emulated.tracked(blocks[2], 1)[5] == name
        assert 0 not in emulated.tracked(blocks[2], 1)


def test_a_repeated_command_gets_the_same_answer_and_keeps_the_lock():
    the_world = emulated.world(soyuz(hot_s=5, warm_s=5))
    _, blocks, _ = emulated.run(the_world, 8)
    held = emulated.tracked(blocks[-1], 1)
    states, _, _ = emulated.run(the_world, 8)
    both = [command(1, 0, RELEASE, transaction=1), command(1, 0, TRACK, held[0], transaction=2)]
    _, blocks, _ = emulated.run(the_world, 3, emulated.orders({8: both, 9: both}), states[-1], 8)
    assert emulated.answers(blocks[0]) == emulated.answers(blocks[1]) == [(1, 0, 0, 1), (1, 0, 0, 2)]
    slips = []
    for block in blocks:
        seen = emulated.channels(block)
        row = (seen["receiver"] == 1) & (seen["channel"] == 0)
        assert row.sum() == 1
        slips.append(int(seen["slips"][row][0]))
    assert slips == [1, 1, 1]


def test_a_corrupted_or_repeated_frame_is_counted_and_not_answered():
    the_world = emulated.world(soyuz())
    good = sealed(command(1, 2, RELEASE))
    bad = frames.FrameBatch(good.t_ns, good.can_id, good.length, good.data ^ np.uint8(4))
    states, blocks, _ = emulated.run(the_world, 4, {1: bad, 2: good, 3: good})
    assert emulated.answers(blocks[1]) == []
    assert len(emulated.answers(blocks[2])) == 1
    assert emulated.answers(blocks[3]) == []
    refused = states[-1].units[0].refused
    assert refused.sum() == 2
    assert refused[4] == 1  # CORRUPTED
    assert refused[2] == 1  # REPEATED
    assert commands_rejected(states[-1]) == {"CORRUPTED": 1, "REPEATED": 1}
    assert commands_rejected(states[0]) == {}


@pytest.mark.parametrize("answered", range(16))
def test_only_answers_to_the_last_three_epochs_are_obeyed(answered):
    """A command weighed with epoch 20: by the epoch it carries, modulo 16, it is obeyed or refused."""
    the_world = emulated.world(soyuz())
    order = {20: sealed(command(1, 2, RELEASE), epoch=answered)}
    states, blocks, _ = emulated.run(the_world, 1, order, emulated.run(the_world, 1)[0][-1], 20)
    obeyed = answered in (17 % 16, 18 % 16, 19 % 16)
    assert (2 not in emulated.tracked(blocks[0], 1)) == obeyed
    assert len(emulated.answers(blocks[0])) == obeyed
    refused = states[0].units[0].refused
    assert refused.sum() == refused[screening.Verdict.MIXED_EPOCH] == 1 - obeyed


def test_a_command_held_back_does_not_undo_a_later_one():
    """RELEASE of epoch 1 arrives after the TRACK of epoch 5 that replaced it."""
    the_world = emulated.world(soyuz())
    name = free_satellites(the_world, 0, 1)[0]
    counters = e2e.fresh_counters(emulated.CODEC)
    old, counters = e2e.protect(emulated.CODEC, command(1, 2, RELEASE), counters, 1)
    _, counters = e2e.protect(emulated.CODEC, command(1, 2, RELEASE), counters, 2)
    new, _ = e2e.protect(emulated.CODEC, command(1, 2, TRACK, name), counters, 5)
    _, blocks, _ = emulated.run(the_world, 9, {6: new, 8: old})
    assert emulated.tracked(blocks[6], 1)[2] == emulated.tracked(blocks[8], 1)[2] == name
    # With the counter alone the receiver would obey whatever comes first in its stream, however old.
    states, blocks, _ = emulated.run(the_world, 9, {8: old})
    assert 2 in emulated.tracked(blocks[8], 1)
    assert states[-1].units[0].refused[screening.Verdict.MIXED_EPOCH] == 1


def test_a_command_held_back_does_not_move_the_counter_of_its_stream():
    """One that is too old, four commands back; the next one is in sequence as if it had not come."""
    the_world = emulated.world(soyuz())
    name = free_satellites(the_world, 0, 1)[0]
    counters, sent = e2e.fresh_counters(emulated.CODEC), []
    for epoch, order in enumerate([command(1, 2, RELEASE)] * 5 + [command(1, 2, TRACK, name)]):
        frame, counters = e2e.protect(emulated.CODEC, order, counters, epoch)
        sent.append(frame)
    heard = {epoch + 1: frame for epoch, frame in enumerate(sent)}
    states, blocks, _ = emulated.run(the_world, 8, {**heard, 6: frames.concat([sent[0], sent[5]])})
    refused = states[-1].units[0].refused
    assert refused.sum() == refused[screening.Verdict.MIXED_EPOCH] == 1
    assert emulated.tracked(blocks[-1], 1)[2] == name


def test_a_satellite_that_cannot_be_seen_is_waited_for_and_a_return_is_a_slip():
    """Commanded out of one antenna's field and seen again: the channel searches all the while."""
    the_world = emulated.world(soyuz(hot_s=2))
    name = free_satellites(the_world, 0, 1)[0]
    row = the_world.row_of[satellites.parse(name)]
    states, blocks, _ = emulated.run(the_world, 3, {1: sealed(command(1, 0, TRACK, name))})
    assert emulated.tracked(blocks[2], 1)[0] == name
    before = emulated.channels(blocks[2])
    blind = blinded(the_world)
    states, blocks, _ = emulated.run(blind, 3, state=states[-1], first=3)
    unit = states[-1].units[0].channels
    assert unit.lock[0, 0] == LOCK["SEARCH"]
    assert unit.target[0, 0] == row
    assert all(0 not in emulated.tracked(b, 1) for b in blocks)
    _, blocks, _ = emulated.run(the_world, 4, state=states[-1], first=6)
    since = [0 in emulated.tracked(b, 1) for b in blocks]
    # Last without signal at epoch 5; two seconds of search end at epoch 7.
    assert since == [False, True, True, True]
    after = emulated.channels(blocks[1])

    def mine(seen):
        return {k: v[(seen["receiver"] == 1) & (seen["channel"] == 0)][0] for k, v in seen.items()}

    assert mine(after)["slips"] == mine(before)["slips"] + 1
    assert 0 <= mine(after)["phase_cyc"] < 1


def blinded(the_world):
    """The same world with antennas that see nothing."""
    vehicle = replace(the_world.craft[0].vehicle, mask_rad=np.full(4, 1e-6))
    return emulated.under(the_world, vehicle=vehicle)


def test_acquisition_takes_the_time_of_the_state_of_knowledge():
    """Cold 12 + 24 s; then a satellite not yet collected 3 + 24 s, one that is known 1 s."""
    the_world = emulated.world(emulated.craft(factors=emulated.QUIET, receivers={"autonomous": "boresight"}))
    states, blocks, _ = emulated.run(the_world, 40)
    tracking = [len(emulated.channels(b)["sat"]) for b in blocks]
    assert tracking[35] == 0
    assert tracking[36] >= 20
    assert emulated.decode(blocks[35], "STATUS")["state"].tolist() == [1] * 4
    assert emulated.decode(blocks[36], "STATUS")["state"].tolist() == [2] * 4
    assert set(emulated.channels(blocks[36])["lock"].tolist()) == {LOCK["FULL"]}
    measured = set(emulated.channels(blocks[39])["sat"].tolist())
    unknown = next(n for n in free_satellites(the_world, 40, 1) if satellites.parse(n) not in measured)
    known_here = emulated.tracked(blocks[39], 1).values()
    known = next(
        n for r in (2, 3, 4) for n in emulated.tracked(blocks[39], r).values() if n not in known_here
    )
    both = command(1, 0, TRACK, unknown), command(1, 1, TRACK, known)
    orders = {40: sealed(*both, epoch=39)}
    _, blocks, _ = emulated.run(the_world, 30, orders, states[-1], 40)
    delivered = [emulated.tracked(b, 1) for b in blocks]
    assert [0 in d for d in delivered].index(True) == 27
    assert [1 in d for d in delivered].index(True) == 1


def test_phase_restarts_before_its_signal_overflows():
    """A phase driven to the end of its range by its ambiguity: it starts anew, and says so by a slip."""
    the_world = emulated.world(soyuz())
    states, blocks, _ = emulated.run(the_world, 2)
    unit = states[-1].units[0]
    far = unit.channels.ambiguity - 1.4e8
    state = replace(states[-1], units=(replace(unit, channels=replace(unit.channels, ambiguity=far)),))
    before = emulated.channels(blocks[1])
    after = emulated.channels(emulated.run(the_world, 1, state=state, first=2)[1][0])
    assert (after["slips"] == before["slips"] + 1).all()
    assert (np.abs(after["phase_cyc"]) < 1).all()
