"""Faults of the sky: what channels report, by cantools, against arithmetic of the test's own."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.faulted import all_sound, by_cantools, of_kind, strike

pytestmark = pytest.mark.verifies(
    "emulator/faults/ranges.py",
    "emulator/faults/kinds/sky.py",
    what="Faults: satellites, systems and oscillators",
    by="cantools; wavelengths and orbital axes worked out again in the test",
    status="validated",
)

C = 299_792_458.0
L1 = {0: (1575.42e6, 0.0), 1: (1602.0e6, 0.5625e6)}


def channels(frames) -> dict[tuple[int, int], dict]:
    """All signals of each (receiver, channel), the satellite as text."""
    found: dict = {}
    for can_id, row in zip(frames.can_id.tolist(), by_cantools(frames), strict=True):
        if 0x100 <= can_id < 0x180 and can_id & 15 < 10:
            found.setdefault(((can_id >> 4 & 7) + 1, row["channel"]), {}).update(row)
    for one in found.values():
        one["name"] = f"{'GR'[one['sat_system']]}{one['sat_number']:02d}"
        carrier, step = L1[one["sat_system"]]
        one["wave_m"] = C / (carrier + step * one["frequency"])
    return found


def pairs(line: str, first: int = 100, last: int = 106):
    """(epochs since the fault began, channel before, channel behind)."""
    for k, one in enumerate(strike(line)[first:last]):
        before, after = channels(one.before), channels(one.block)
        assert before.keys() == after.keys() and all_sound(of_kind(one.block, "RANGE"))
        for key in before:
            yield k, before[key], after[key]


def shift(before: dict, after: dict) -> tuple[float, float, float]:
    """Of range [m], rate [m/s] and phase [m]."""
    return (
        after["pseudorange_m"] - before["pseudorange_m"],
        after["range_rate_mps"] - before["range_rate_mps"],
        (after["phase_cyc"] - before["phase_cyc"]) * before["wave_m"],
    )


@pytest.mark.parametrize(
    ("line", "struck", "expected"),
    [
        ("G07 range 30 m @100", lambda c: c["name"] == "G07", lambda k: (30, 0, 30)),
        ("rx3 ch1 range 100 carrier=false @100", None, lambda k: (100, 0, 0)),
        ("R11 ramp 2 m/s @100", lambda c: c["name"] == "R11", lambda k: (2 * k, 2, 2 * k)),
        ("G07 clock 100 ns @100", lambda c: c["name"] == "G07", lambda k: (-C * 1e-7, 0, -C * 1e-7)),
        ("glonass bias 50 @100", lambda c: c["sat_system"] == 1, lambda k: (50, 0, 50)),
        ("oscillator 1000 ns @100", lambda c: True, lambda k: (C * 1e-6, 0, C * 1e-6)),
        (
            "oscillator rate_ns_per_s=10 @100",
            lambda c: True,
            lambda k: (C * 1e-8 * k, C * 1e-8, C * 1e-8 * k),
        ),
    ],
)
def test_ranges_rates_and_phases_move_together(line, struck, expected):
    seen = 0
    for k, before, after in pairs(line):
        alone = (
            before["channel"] == 1 and struck is None and before["pseudorange_m"] != after["pseudorange_m"]
        )
        hit = alone if struck is None else struck(before)
        wanted = expected(k) if hit else (0, 0, 0)
        assert shift(before, after) == pytest.approx(wanted, abs=2e-4)
        seen += hit
    assert seen >= 6


def test_a_step_of_one_channel_is_of_that_channel():
    moved = {
        (k, b["name"])
        for k, b, a in pairs("rx3 ch1 range 100 @100+1")
        if a["pseudorange_m"] != b["pseudorange_m"]
    }
    assert len(moved) == 1


def test_time_tags_go_with_the_oscillator():
    one = strike("oscillator 1000 ns @100")[100]
    before, after = (by_cantools(of_kind(frames, "TAG")) for frames in (one.before, one.block))
    assert [b["tag_offset_ns"] - a["tag_offset_ns"] for a, b in zip(before, after, strict=True)] == [1000] * 4


def position(row: dict) -> np.ndarray:
    return np.array([row["x_m"], row["y_m"], row["z_m"]])


@pytest.mark.parametrize("key", ["radial_m", "along_m", "cross_m"])
def test_an_ephemeris_is_wrong_along_its_own_axes(key):
    for _, before, after in pairs(f"G07 ephemeris {key}=500 @100"):
        moved = position(after) - position(before)
        if before["name"] != "G07":
            assert not moved.any()
            continue
        out = position(before) / np.linalg.norm(position(before))
        vel = np.array([before["vx_mps"], before["vy_mps"], before["vz_mps"]])
        left = np.cross(out, vel) / np.linalg.norm(np.cross(out, vel))
        axis = {"radial_m": out, "along_m": np.cross(left, out), "cross_m": left}[key]
        assert moved == pytest.approx(500 * axis, abs=2e-4)
        assert key != "along_m" or moved @ vel > 0, "ahead is where it goes"


def test_coordinates_by_a_factor():
    for _, before, after in pairs("G07 coordinates 0.5 @100"):
        factor = 0.5 if before["name"] == "G07" else 1.0
        assert position(after) == pytest.approx(factor * position(before), abs=1e-4)


def test_unhealthy_is_said_in_message_and_almanac():
    struck = strike("G07 unhealthy @100")
    said = [row["health"] for one in struck[100:] for row in by_cantools(of_kind(one.block, "ALM_Z"))
            if (row["sat_system"], row["sat_number"]) == (0, 7)]  # fmt: skip
    assert said and set(said) == {1}
    assert {after["health"] for _, b, after in pairs("G07 unhealthy @100") if b["name"] == "G07"} == {1}
    assert {after["health"] for _, b, after in pairs("G07 unhealthy @100") if b["name"] != "G07"} == {0}


def test_a_carrier_of_unknown_wavelength_stays_what_it_was():
    """Without the frame that tells a channel's frequency nobody knows how many cycles 30 m are."""
    for one in strike("rx1 SV_VZ loss @100+4", "rx1 range 30 m @100+4")[100:104]:
        for kind, moved in (("RANGE", True), ("PHASE", False)):
            before, after = (of_kind(frames, kind).data[:, 2:] for frames in (one.before, one.block))
            of_one = of_kind(one.block, kind).can_id >> 4 & 7 == 0
            assert of_one.any() and ((before != after).any(axis=1) == (of_one & moved)).all()
