"""The emulator's epoch as a listener on the bus meets it."""

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.contract import e2e, frames, screening
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.emulator import assemble
from gnss_hil.emulator.step import emulate_step
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/receivers/frames.py",
    "emulator/receivers/emulated/almanac.py",
    what="Blocks of frames, almanac",
    by=(
        "order and dealing of the almanac are ours; unless files are named it is without errors, age 0; ages "
        "end at 255 h"
    ),
    status="modelled",
)

LIGHT = 299_792_458.0
OMEGA = 7.2921151467e-5

_RANGE = emulated.CODEC.kinds["RANGE"]
ROUNDING_M = 2 * float(_RANGE.factor[_RANGE.signals.index("pseudorange_m")])
"""What rounding to the bus's resolution leaves of range (1/2), clock (1/2) and coordinates (sqrt(3)/2)."""


def rotate(vectors, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = vectors
    return np.array([cos * x + sin * y, cos * y - sin * x, z])


def phase_centres(truth):
    """ECEF positions (4, 3) of the antennas from truth's quaternion, written out with Hamilton's product."""
    w, *v = truth["quaternion_body_from_ecef"]
    v = -np.array(v)  # ecef from body: the conjugate of a passive body-from-ecef quaternion, v' = q* v q
    lever = emulated.VEHICLE.lever_arm_body_m
    turned = lever - 2 * w * np.cross(v, lever) + 2 * np.cross(v, np.cross(v, lever))
    return truth["position_ecef_m"] + turned


def predicted_range_m(seen, truth):
    """Pseudoranges from decoded satellites and truth, the way a consumer would: in ECEF of reception, by
    iterating the rotation, with every effect of the contract's document."""
    receiver = seen["receiver"] - 1
    antenna = phase_centres(truth)[receiver].T
    satellite = np.array([seen["x_m"], seen["y_m"], seen["z_m"]])
    flight = np.full(len(receiver), 0.075)
    for _ in range(10):
        distance = np.linalg.norm(rotate(satellite, OMEGA * flight) - antenna, axis=0)
        flight = distance / LIGHT
    r1, r2 = np.linalg.norm(satellite, axis=0), np.linalg.norm(antenna, axis=0)
    shapiro = 2 * 3.986004418e14 / LIGHT**2 * np.log((r1 + r2 + distance) / (r1 + r2 - distance))
    clock = LIGHT * truth["clock_s"][emulated.VEHICLE.clock_domain[receiver]]
    offset = np.where(seen["sat_system"] == satellites.GLONASS, 30e-9 * LIGHT, 0.0)
    return distance + shapiro + clock + offset - seen["clock_m"]


@pytest.fixture(scope="module")
def quiet():
    """Ten epochs without noise, receivers that need no time to acquire, clocks wandering by +-1 ms."""
    soyuz = emulated.craft(
        receivers=emulated.QUICK, factors=emulated.QUIET, clock={"amplitude_ms": 1.0, "period_s": 5400}
    )
    return emulated.run(emulated.world(soyuz), 10)


@pytest.mark.verifies(
    "emulator/assemble/world.py",
    "emulator/assemble/shared.py",
    "emulator/assemble/emulated.py",
    "emulator/state.py",
    "emulator/receivers/base.py",
    "emulator/environment/block.py",
    "emulator/receivers/emulated/receiver.py",
    "emulator/receivers/emulated/prepared.py",
    "emulator/receivers/emulated/craft.py",
    "emulator/step.py",
    what="One epoch of an emulated craft, from scenario to frames",
    by=(
        "pseudoranges of whole runs against geometry written apart (rotation iterated, Hamilton's product, "
        "Shapiro), to the rounding of the bus; RTKLIB finds the craft from the frames: 3 mm"
    ),
    status="validated",
)
def test_every_pseudorange_obeys_the_contract(quiet):
    _, blocks, truths = quiet
    for block, truth in zip(blocks, truths, strict=True):
        seen = emulated.channels(block)
        assert len(seen["sat"]) == 24
        assert len(set(seen["sat_system"])) == 2
        assert np.abs(seen["pseudorange_m"] - predicted_range_m(seen, truth)).max() < ROUNDING_M


def test_clocks_move_the_ranges(quiet):
    _, _, truths = quiet
    assert abs(truths[0]["clock_s"]).max() > 1e-5
    assert len(np.unique(truths[0]["clock_s"])) == 8


def test_range_rate_is_the_derivative_of_the_carrier():
    """At 0.1 s over 0.4 s: fourth-order differences of the phase, rounded to 0.2 mm, tell 1 mm/s."""
    soyuz = emulated.craft(receivers=emulated.QUICK, factors=emulated.QUIET, clock={"amplitude_ms": 1.0})
    _, blocks, _ = emulated.run(emulated.world(soyuz, interval_s=0.1), 5)
    seen = [emulated.channels(block) for block in blocks]
    wave = LIGHT / np.where(seen[2]["sat_system"] == 0, 1575.42e6, 1602e6 + 562.5e3 * seen[2]["frequency"])
    phase = [wave * s["phase_cyc"] for s in seen]
    difference = (8 * (phase[3] - phase[1]) - (phase[4] - phase[0])) / 1.2
    assert np.abs(difference - seen[2]["range_rate_mps"]).max() < 3e-3
    assert np.abs(seen[2]["range_rate_mps"]).max() > 1000


def test_phase_follows_range_without_slip(quiet):
    _, blocks, _ = quiet
    first = emulated.channels(blocks[0])
    wave = LIGHT / np.where(first["sat_system"] == 0, 1575.42e6, 1602e6 + 562.5e3 * first["frequency"])
    apart = []
    for block in blocks:
        seen = emulated.channels(block)
        assert (seen["sat"] == first["sat"]).all()
        assert (seen["slips"] == first["slips"]).all()
        apart.append(seen["pseudorange_m"] - wave * seen["phase_cyc"])
    assert np.ptp(apart, axis=0).max() < 2e-3
    assert (first["phase_cyc"] >= 0).all()
    assert (first["phase_cyc"] < 1).all()
    cycles = apart[0] / wave
    assert np.abs(cycles - np.round(cycles)).max() < 0.01  # the ambiguity is whole


def test_satellite_velocity_is_the_derivative_of_its_position(quiet):
    _, blocks, _ = quiet
    before, now, after = (emulated.channels(blocks[k]) for k in (0, 1, 2))
    for axis in "xyz":
        moved = (after[f"{axis}_m"] - before[f"{axis}_m"]) / 2
        # Transmission instants are not one second apart: 7 km/s of range change moves them by 24 us.
        assert np.abs(moved - now[f"v{axis}_mps"]).max() < 0.2
    assert np.hypot(np.hypot(now["vx_mps"], now["vy_mps"]), now["vz_mps"]).min() > 2000


def test_order_of_a_block(quiet):
    _, blocks, _ = quiet
    the_codec = codec(4)
    names = [the_codec.layouts[the_codec.kind_of[i]].name for i in blocks[3].can_id]
    assert names[:6] == ["TIME_MARK", "TIME_GPS", "TIME_FINE", "ATT_Q01", "ATT_Q23", "ATT_RATE"]
    per_channel = ["RANGE", "RATE", "PHASE", "SV_X", "SV_Y", "SV_Z", "SV_VX", "SV_VY", "SV_VZ", "SV_CLOCK"]
    at = 6
    for receiver in (1, 2, 3, 4):
        for channel in range(6):
            assert names[at : at + 10] == per_channel
            rows = slice(at, at + 10)
            assert (the_codec.number_of[blocks[3].can_id[rows]] == receiver).all()
            assert set(blocks[3].data[rows, 2] & 31) == {channel}
            at += 10
        assert names[at : at + 2] == ["TAG", "STATUS"]
        at += 2
    almanac = (len(names) - at - 6) // 3
    assert names[at:-6] == ["ALM_XY", "ALM_Z", "ALM_V"] * almanac
    assert names[-6:] == ["HEARTBEAT"] * 6
    assert (blocks[3].t_ns == gpstime.from_calendar(gpstime.datetime(2012, 10, 31, 0, 15, 3))).all()


def test_status_counts_and_tags(quiet):
    _, blocks, truths = quiet
    status, tag = emulated.decode(blocks[5], "STATUS"), emulated.decode(blocks[5], "TAG")
    assert status["frames"].tolist() == [61] * 4
    assert status["channels_tracking"].tolist() == [6] * 4
    assert status["almanac_satellites"].tolist() == [48] * 4
    behind_ns = 1e9 * truths[5]["clock_s"][0] - tag["tag_offset_ns"]
    assert (behind_ns >= 0).all() and (behind_ns < 100).all()


def test_the_tag_does_not_tell_the_clock(quiet):
    _, blocks, truths = quiet
    tags = [emulated.decode(block, "TAG")["tag_offset_ns"] for block in blocks]
    clocks_ns = [1e9 * truth["clock_s"][0] for truth in truths]
    assert not np.mod(tags, 100).any()
    assert np.ptp(clocks_ns - np.array(tags)[:, 0]) > 10


def test_time_mark_and_heartbeats(quiet):
    _, blocks, _ = quiet
    mark, gps, fine = (emulated.decode(blocks[4], kind) for kind in ("TIME_MARK", "TIME_GPS", "TIME_FINE"))
    assert (mark["session"][0], mark["epoch"][0]) == (7, 4)
    t_ns = gpstime.from_week(int(gps["week"][0]), int(gps["second"][0]), int(fine["nanosecond"][0]))
    assert gpstime.iso(t_ns) == "2012-10-31T00:15:04"
    assert fine["leap"][0] == 16
    beat = emulated.decode(blocks[4], "HEARTBEAT")
    assert beat["receiver"].tolist() == [1, 2, 3, 4, 9, 10]
    assert set(beat["contract_hash"].tolist()) == {codec(4).hash}


def test_utc_keeps_its_leap_seconds_and_the_earth_does_not():
    """Across the leap second of 2012-06-30: 23:59:60 UTC begins at 00:00:15 GPS."""
    time = {"start_gps": "2012-07-01T00:00:13", "duration_s": 6}
    _, blocks, truths = emulated.run(emulated.world(time=time), 6)
    assert [int(emulated.decode(block, "TIME_FINE")["leap"][0]) for block in blocks] == [
        15,
        15,
        15,
        16,
        16,
        16,
    ]
    moved = np.diff([truth["position_ecef_m"] for truth in truths], axis=0)
    assert np.abs(np.diff(np.linalg.norm(moved, axis=1))).max() < 1  # a jump would be 480 m


def test_frames_pass_the_receivers_checks_in_every_epoch(quiet):
    _, blocks, _ = quiet
    counters = e2e.fresh_counters(codec(4))
    for block in blocks:
        screened = screening.screen(codec(4), block, counters)
        counters = screened.counters
        assert (screened.verdict == screening.Verdict.OK).all()


def test_attitude_on_the_bus_is_truth(quiet):
    _, blocks, truths = quiet
    first, second = emulated.decode(blocks[2], "ATT_Q01"), emulated.decode(blocks[2], "ATT_Q23")
    sent = [first["q0"][0], first["q1"][0], second["q2"][0], second["q3"][0]]
    assert np.abs(sent - truths[2]["quaternion_body_from_ecef"]).max() < 1e-7
    rate = emulated.decode(blocks[2], "ATT_RATE")
    assert rate["wy_rps"][0] == pytest.approx(truths[2]["rate_body_rps"][1], abs=2e-6)
    assert abs(rate["wy_rps"][0]) == pytest.approx(2 * np.pi / 5570, rel=0.01)


def test_whole_almanac_passes_in_its_cycle_from_receivers_in_turn():
    the_world = emulated.world()
    _, blocks, _ = emulated.run(the_world, 40)
    for cycle in range(2):
        seen = {}
        for epoch in range(20 * cycle, 20 * cycle + 20):
            xy, z, v = (emulated.decode(blocks[epoch], kind) for kind in ("ALM_XY", "ALM_Z", "ALM_V"))
            truth = the_world.sky.at(the_world.start_ns + epoch * the_world.interval_ns)
            for i, index in enumerate(satellites.index(xy["sat_system"], xy["sat_number"]).tolist()):
                row = the_world.row_of[index]
                seen[index] = int(xy["receiver"][i])
                sent = np.array([xy["x_m"][i], xy["y_m"][i], z["z_m"][i]])
                assert np.abs(sent - truth.pos_ecef_m[row]).max() <= 125
                rates = np.array([v[f"v{axis}_mps"][i] for axis in "xyz"])
                assert np.abs(rates - truth.vel_ecef_mps[row]).max() <= 0.5
        assert sorted(seen) == sorted(the_world.sky.index.tolist())
        assert all(r == (the_world.row_of[index] + cycle) % 4 + 1 for index, r in seen.items())


def test_truth_in_view_is_a_set_of_satellites(quiet):
    _, blocks, truths = quiet
    names = {
        64 * system + number
        for system in range(8)
        for number in range(64)
        if int(truths[0]["in_view"][system]) >> number & 1
    }
    assert len(names) == truths[0]["satellites_visible"] > 20
    assert set(emulated.channels(blocks[0])["sat"].tolist()) <= names


def test_same_inputs_same_bytes_and_nothing_is_modified():
    the_world = emulated.world(emulated.craft(receivers=emulated.QUICK))
    states, blocks, _ = emulated.run(the_world, 5)
    _, again, _ = emulated.run(emulated.world(emulated.craft(receivers=emulated.QUICK)), 5)
    assert [b.data.tobytes() for b in blocks] == [b.data.tobytes() for b in again]
    _, repeated, _ = emulated.run(the_world, 1, state=states[1], first=2)
    assert repeated[0].data.tobytes() == blocks[2].data.tobytes()


def test_noise_depends_neither_on_commands_nor_on_other_craft():
    """The same satellite at the same receiver and epoch has the same error, whichever channel has it."""
    quiet_world = emulated.world(emulated.craft(receivers=emulated.QUICK, factors=emulated.QUIET))
    noisy = emulated.craft(receivers=emulated.QUICK)
    orders = {
        1: emulated.sealed(emulated.command(1, 0, emulated.RELEASE), emulated.command(1, 1, emulated.RELEASE))
    }

    def errors(noisy_world, given):
        clean = emulated.channels(emulated.run(quiet_world, 3, given)[1][2])
        disturbed = emulated.channels(emulated.run(noisy_world, 3, given)[1][2])
        assert (clean["sat"] == disturbed["sat"]).all()
        keys = zip(clean["receiver"].tolist(), clean["sat"].tolist(), strict=True)
        return dict(zip(keys, (disturbed["pseudorange_m"] - clean["pseudorange_m"]).tolist(), strict=True))

    alone = errors(emulated.world(noisy), None)
    commanded = errors(emulated.world(noisy), orders)
    accompanied = errors(emulated.world(noisy, emulated.craft("progress", receivers=emulated.QUICK)), None)
    assert len(set(alone.values())) == 24
    assert 0.05 < np.std(list(alone.values())) < 3
    assert alone == accompanied
    common = alone.keys() & commanded.keys()
    assert len(common) == 22
    assert all(abs(alone[key] - commanded[key]) <= 1.001e-4 for key in common)


def test_other_seed_other_noise():
    one, two = (
        emulated.run(emulated.world(emulated.craft(receivers=emulated.QUICK), seed=s), 1)[1][0]
        for s in (1, 2)
    )
    assert (emulated.channels(one)["range_rate_mps"] != emulated.channels(two)["range_rate_mps"]).all()


def test_two_craft_have_a_bus_each():
    the_world = emulated.world(emulated.craft("soyuz", receivers=emulated.QUICK), emulated.craft("progress"))
    state = assemble.initial_state(the_world)
    _, sent, truth = emulate_step(the_world, state, {}, 0)
    assert list(sent) == ["soyuz", "progress"]
    assert truth["craft"].tolist() == [0, 1]
    assert len(emulated.channels(sent["soyuz"])["sat"]) == 24
    assert len(emulated.channels(sent["progress"])["sat"]) == 0


def test_whatever_a_bus_may_carry_does_not_raise():
    """Random frames of every form, commands among them; the emulator goes on and answers none."""
    the_world = emulated.world()
    random = np.random.Generator(np.random.PCG64(3))
    state = assemble.initial_state(the_world)
    for epoch in range(20):
        n = 60
        can_id = random.integers(0x000, 0x800, n).astype(np.uint32)
        can_id[:20] = random.integers(0x020, 0x028, 20)
        can_id[20:30] |= random.choice([frames.EFF_FLAG, frames.RTR_FLAG, frames.ERR_FLAG], 10).astype(
            np.uint32
        )
        noise = frames.FrameBatch(
            np.zeros(n, np.int64),
            can_id,
            random.integers(0, 9, n).astype(np.uint8),
            random.integers(0, 256, (n, 8)).astype(np.uint8),
        )
        state, sent, _ = emulate_step(the_world, state, {"soyuz": noise}, epoch)
        assert len(emulated.channels(sent["soyuz"])["sat"]) == 24
    assert state.units[0].refused.sum() > 100
