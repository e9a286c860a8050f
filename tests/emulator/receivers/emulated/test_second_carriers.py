"""Receivers of two carriers, stepped by hand: each signal on a channel of its own, and what it measures."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites, vehicle
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.receivers.emulated.commands import RESULT
from tests.support import emulated
from tests.support.emulated import RELEASE, TRACK, command

pytestmark = pytest.mark.verifies(
    "emulator/receivers/emulated/commands.py",
    "emulator/receivers/emulated/search.py",
    "emulator/environment/signals.py",
    "emulator/environment/block.py",
    what="Second carriers on channels of their own",
    by=(
        "closed forms: 40.3 TEC / f^2 on both carriers, phases and Doppler by frequency, T_GD as IS-GPS-200 "
        "has it, code noise by C/N0"
    ),
    status="validated",
)

LIGHT = 299_792_458.0
VEHICLE = vehicle.load(vehicle.find("soyuz-ms-l1l2"))
VALUE = {name: signal.value for name, signal in SIGNALS.items()}
FIRST, SECOND = {"G": "L1CA", "R": "L1OF"}, {"G": "L2C", "R": "L2OF"}
HZ = {"L1CA": (1575.42e6, 0), "L2C": (1227.6e6, 0), "L1OF": (1602e6, 562.5e3), "L2OF": (1246e6, 437.5e3)}


def world(factors=emulated.QUIET, flown=VEHICLE, sky=None, receivers=None):
    craft = emulated.craft(factors=factors, receivers={**emulated.QUICK, **(receivers or {})})
    table = emulated.document(craft, sky=sky or {})
    table["time"]["start_gps"] = "2023-03-23T00:15:00"
    return assemble.build_world(scenario.parse(table, "test"), [flown], 7)


def measured(block):
    """Receiver, satellite and signal -> signals of a channel's measurement frames."""
    columns = emulated.channels(block)
    names = [satellites.name(sat) for sat in columns["sat"]]
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return {
        (int(row["receiver"]), name, int(row["signal"])): row for name, row in zip(names, rows, strict=True)
    }


def pairs(block):
    """(first, second) of every satellite and receiver that has both."""
    found = measured(block)
    return {
        (r, sat): (row, found[r, sat, VALUE[SECOND[sat[0]]]])
        for (r, sat, signal), row in found.items()
        if signal == VALUE[FIRST[sat[0]]] and (r, sat, VALUE[SECOND[sat[0]]]) in found
    }


def carrier_hz(name, row):
    base, step = HZ[name]
    return base + step * row["frequency"]


def last(the_world, epochs=1, orders=None):
    return emulated.run(the_world, epochs, orders)[1][-1]


def test_receivers_left_alone_take_their_satellites_by_both_signals():
    """Twelve channels: highest first, both signals of those that send two, one of the others."""
    the_world = world()
    block, scene = last(the_world), emulated.epoch_at(the_world, 0)
    found = measured(block)
    n = len(scene.sky.index)
    sends = the_world.craft[0].environment.carriers.reaches[1, 0, scene.sky.index]
    high = np.argsort(-scene.view.sin_elevation)
    for receiver in range(1, 5):
        mine = {(sat, signal) for r, sat, signal in found if r == receiver}
        wanted = []
        for row in high:
            name = satellites.name(scene.sky.index[row])
            if scene.signal[receiver - 1, row]:
                wanted.append((name, VALUE[FIRST[name[0]]]))
                if scene.signal[receiver - 1, n + row]:
                    assert sends[row]
                    wanted.append((name, VALUE[SECOND[name[0]]]))
        assert mine == set(wanted[:12])


@pytest.mark.parametrize("activity", ["low", "high"])
def test_the_ionosphere_delays_codes_by_the_square_of_the_wave_and_turns_carriers_back(activity):
    free, thick = (
        pairs(last(world(sky={"factors": {"ionosphere": {"enabled": on, "activity": activity}}}), 2))
        for on in (False, True)
    )
    assert len(thick) > 12 and thick.keys() == free.keys()
    for key, (one, two) in thick.items():
        names, plain = (FIRST[key[1][0]], SECOND[key[1][0]]), free[key]
        late = [
            row["pseudorange_m"] - was["pseudorange_m"] for row, was in zip((one, two), plain, strict=True)
        ]
        f1, f2 = (carrier_hz(name, one) for name in names)
        assert late[0] > 0.3
        assert late[1] / late[0] == pytest.approx((f1 / f2) ** 2, abs=4e-4 / late[0])
        rate = [
            row["range_rate_mps"] - was["range_rate_mps"] for row, was in zip((one, two), plain, strict=True)
        ]
        assert rate[1] - rate[0] * (f1 / f2) ** 2 == pytest.approx(0, abs=4e-4)


def test_ranges_differ_by_what_clocks_say_and_doppler_goes_by_the_carrier():
    """Without errors: P2 - P1 is what the clocks on the bus differ by, T_GD (1 - gamma) less for GPS."""
    the_world = world()
    blocks = emulated.run(the_world, 3)[1]
    before, after = pairs(blocks[1]), pairs(blocks[2])
    sky = emulated.epoch_at(the_world, 2).sky
    assert len(after) > 12
    differs = 0
    for key, (one, two) in after.items():
        row = np.flatnonzero(sky.index == satellites.parse(key[1]))[0]
        clock_m = two["clock_m"] - one["clock_m"]
        assert two["pseudorange_m"] - one["pseudorange_m"] == pytest.approx(-clock_m, abs=3e-4)
        gamma = (77 / 60) ** 2
        told_m = (
            (1 - gamma) * sky.broadcast.group_delay_m[row]
            if key[1][0] == "G"
            else -sky.broadcast.band_delay_m[row]
        )
        assert clock_m == pytest.approx(told_m, abs=3e-4)
        differs += abs(clock_m) > 0.1
        f1, f2 = (carrier_hz(by[key[1][0]], one) for by in (FIRST, SECOND))
        assert one["range_rate_mps"] == pytest.approx(two["range_rate_mps"], abs=3e-4)
        turned = [
            now["phase_cyc"] - was["phase_cyc"] for now, was in zip((one, two), before[key], strict=True)
        ]
        assert turned[1] * LIGHT / f2 == pytest.approx(turned[0] * LIGHT / f1, abs=1e-3)
    assert differs > 8, "nominal satellites have delays between carriers"


def test_noise_of_the_carriers_is_independent_and_by_their_own_levels():
    """Kaplan & Hegarty: chips sqrt(B D / 2 C/N0 (1 + 2 / ((2 - D) T C/N0))); L2OF is some 6 dB weaker."""
    quiet = {**emulated.QUIET, "code_noise": True}
    noisy, clean = world(quiet), world()
    errors: list[tuple[float, ...]] = []
    for loud, plain in zip(emulated.run(noisy, 40)[1][1:], emulated.run(clean, 40)[1][1:], strict=True):
        with_noise, without = pairs(loud), pairs(plain)
        for key in with_noise.keys() & without.keys():
            chip_m = LIGHT / (1.023e6 if key[1][0] == "G" else 0.511e6)
            row = []
            for have, free in zip(with_noise[key], without[key], strict=True):
                cn0 = 10 ** (free["cn0_dbhz"] / 10)
                sigma_m = chip_m * np.sqrt(0.125 / cn0 * (1 + 2 / (1.5 * 0.02 * cn0)))
                row.append((have["pseudorange_m"] - free["pseudorange_m"]) / sigma_m)
            errors.append(tuple(row))
    standard = np.array(errors)
    assert len(standard) > 500
    bound = 5 / np.sqrt(len(standard))
    assert standard.std(axis=0) == pytest.approx([1, 1], abs=bound)
    assert abs(np.corrcoef(standard.T)[0, 1]) < bound


def test_a_command_sets_a_channel_on_one_signal_and_says_where_there_is_none():
    the_world = world()
    block = last(the_world)
    two = next(sat for (r, sat) in pairs(block) if r == 1 and sat[0] == "G")
    alone = next(sat for r, sat, _ in measured(block) if sat[0] == "G" and (r, sat) not in pairs(block))
    clear = [command(1, c, RELEASE) for c in range(12)]
    orders = emulated.orders({
        1: clear,
        2: [command(1, 3, TRACK, two, signal=VALUE["L2C"])],
        3: [command(1, 4, TRACK, two, signal=VALUE["L1CA"]), command(1, 5, TRACK, two, signal=VALUE["L2C"])],
        4: [command(1, 5, TRACK, alone, signal=VALUE["L2C"]), command(1, 6, TRACK, two, signal=VALUE["L5"])],
        5: [command(1, 3, RELEASE), command(1, 7, TRACK, two, signal=VALUE["L2C"])],
    })  # fmt: skip
    _, blocks, _ = emulated.run(the_world, 6, orders)
    assert [a[2] for a in emulated.answers(blocks[2])] == [RESULT["ACCEPTED"]]
    assert [key for key in measured(blocks[2]) if key[0] == 1] == [(1, two, VALUE["L2C"])]
    assert [a[2] for a in emulated.answers(blocks[3])] == [RESULT["ACCEPTED"], RESULT["ALREADY_TRACKED_HERE"]]
    assert {key[2] for key in measured(blocks[3]) if key[0] == 1} == {VALUE["L1CA"], VALUE["L2C"]}
    assert [a[2] for a in emulated.answers(blocks[4])] == [RESULT["NO_SUCH_SIGNAL"]] * 2
    assert [a[2] for a in emulated.answers(blocks[5])] == [RESULT["ACCEPTED"]] * 2


def test_an_ephemeris_collected_by_one_signal_serves_the_other():
    """The first receiver has first signals alone, the second is silent until it is set on second ones: these
    measure at once."""
    others = ((), VEHICLE.other_signals[1], (), ())
    the_world = world(flown=replace(VEHICLE, other_signals=others), receivers={"ephemeris_s": 5.0})
    silent = {0: [command(r, c, RELEASE) for r in (2, 3, 4) for c in range(12)]}
    known = {sat for r, sat, _ in measured(emulated.run(the_world, 8, emulated.orders(silent))[1][-1])}
    scene = emulated.epoch_at(the_world, 8)
    n = len(scene.sky.index)
    index = [satellites.name(i) for i in scene.sky.index]
    both = [sat for sat in sorted(known) if scene.signal[1, n + index.index(sat)]]
    assert len(both) > 3
    signals = [VALUE[SECOND[sat[0]]] for sat in both]
    wanted = [
        command(2, c, TRACK, sat, signal=signal)
        for c, (sat, signal) in enumerate(zip(both, signals, strict=True))
    ]
    _, blocks, _ = emulated.run(the_world, 9, emulated.orders({**silent, 8: wanted}))
    measures = {(sat, signal) for r, sat, signal in measured(blocks[8]) if r == 2}
    assert measures == set(zip(both, signals, strict=True))


def test_antennas_have_another_gain_and_phase_centre_for_other_carriers():
    """80 mm further out along the boresight: nearer by 80 mm times the cosine of the angle off it."""
    told = {"other_signals_gain_db": -2.5, "other_signals_centre_mm": 80.0}
    apart, one = world(receivers=told), world()
    found, plain = pairs(last(apart)), pairs(last(one))
    scene = emulated.epoch_at(one, 0)
    index = [satellites.name(i) for i in scene.sky.index]
    assert len(found) > 12
    for key, (first, second) in found.items():
        was = plain[key]
        assert first == was[0]
        nearer = 0.08 * np.cos(scene.view.angle_rad[key[0] - 1, index.index(key[1])])
        assert was[1]["pseudorange_m"] - second["pseudorange_m"] == pytest.approx(nearer, abs=2e-4)
        assert was[1]["cn0_dbhz"] - second["cn0_dbhz"] == pytest.approx(2.5, abs=0.26)
    phase_m = [
        (pairs(emulated.run(w, 3)[1][-1])[key][1]["phase_cyc"] * LIGHT / carrier_hz(SECOND[key[1][0]], first))
        for w in (apart, one)
    ]
    assert abs(phase_m[0] - phase_m[1]) < 0.5, "the carrier's way is the code's"


def test_a_jammer_on_l2_leaves_l1_alone():
    """Noise of 1 MHz about L2C, from the zenith, at -115 dBW: it is lost; L1 stays, L2OF nearly."""
    jam = {"kind": "noise", "centre_mhz": 1227.6, "bandwidth_mhz": 1.0}
    jam |= {"direction_body": [0.0, 0.0, -1.0], "received_dbw": -115.0}
    jammed, free = (
        pairs(last(world(factors={**emulated.QUIET, **more})))
        for more in ({"jamming": {"body": [jam]}}, {"link_budget": True})
    )
    gps = [key for key in free if key[1][0] == "G"]
    assert gps and not [key for key in jammed if key[1][0] == "G"], "lost, or never found"
    glonass = [key for key in free if key[1][0] == "R"]
    assert set(glonass) <= set(jammed)
    clean, noisy = (
        measured(last(world(factors={**emulated.QUIET, "jamming": {"body": [one]}})))
        for one in ({**jam, "received_dbw": -300.0}, jam)
    )
    for key in clean.keys() & noisy.keys():
        within = 1.01 if key[2] == VALUE["L2OF"] else 0
        assert clean[key]["cn0_dbhz"] - noisy[key]["cn0_dbhz"] == pytest.approx(0, abs=within)


def test_blocks_that_a_scenario_chooses_send_what_they_have():
    found = pairs(last(world()))
    sat = next(name for _, name in found if name[0] == "G")
    old = {"transmit_pattern": {"blocks": {sat: "gps-iia"}}}
    changed = {name for _, name in pairs(last(world(factors={**emulated.QUIET, **old})))}
    assert sat not in changed and any(name[0] == "G" for name in changed)
    none = {"transmit_pattern": {"gps": "gps-iir-improved"}}
    assert all(name[0] == "R" for _, name in pairs(last(world(factors={**emulated.QUIET, **none}))))
    every = {"transmit_pattern": {"gps": "gps-iirm"}}
    block = last(world(factors={**emulated.QUIET, **every}))
    assert {name for _, name in pairs(block)} == {name for _, name, _ in measured(block)}


def test_slips_of_the_carriers_are_their_own():
    slipping = {**emulated.QUIET, "cycle_slips": {"per_hour": 600.0, "costas": False}}
    blocks = emulated.run(world(factors=slipping), 60)[1]
    counts = [pairs(block) for block in blocks[5:]]
    moved = [
        [now[key][k]["slips"] != was[key][k]["slips"] for k in (0, 1)]
        for was, now in pairwise(counts)
        for key in now.keys() & was.keys()
    ]
    first, second = np.array(moved).T
    assert first.mean() == pytest.approx(1 / 6, rel=0.3) == second.mean()
    assert abs(np.corrcoef(first, second)[0, 1]) < 5 / np.sqrt(len(first))


def test_a_vehicle_with_a_signal_that_nobody_sends_is_refused_by_name():
    with pytest.raises(
        ScenarioError, match="vehicle 'soyuz-ms-l1l2': other_signals: signal L2P is sent by no"
    ):
        world(flown=replace(VEHICLE, other_signals=(("L2P",), (), (), ())))
