"""The patent's promise, checked from bus.log alone: RU 2706636 C1, claim 1, steps 5 to 9.

Nothing of the flight software is used here: frames are decoded by cantools, angles are computed from
the attitude, the satellites and the fix that stand on the bus, boresights and masks from the vehicle file.
"""

from __future__ import annotations

import math
import subprocess
import tomllib
from collections import Counter
from importlib import resources
from pathlib import Path

import pytest

from tests.support import buslog
from tests.support.programs import GNSS_HIL

pytestmark = [
    pytest.mark.verifies(
        "flightsw/assignment/nearest_boresight.py",
        "flightsw/assignment/registry.py",
        "flightsw/assignment/options.py",
        what="Assignment by the patent (blocks 8, 9)",
        by="exhaustive reading of the claim; a second reader of bus.log with cantools",
        status="validated",
    ),
    pytest.mark.verifies(
        "flightsw/io/encode.py",
        "flightsw/records/commands.py",
        what="Encoding: fixes and commands as frames",
        by="decoded by cantools in the second reader",
        status="validated",
    ),
]

DBC = Path(str(resources.files("gnss_hil.dbc.contract") / "gnss.dbc"))
VEHICLE = tomllib.loads((resources.files("gnss_hil.dbc") / "vehicles" / "soyuz-ms.toml").read_text("utf-8"))

# A satellite that is not tracked is known from the almanac only: 250 m steps, up to 20 s of linear
# extrapolation.
TIE_DEG = 0.02


LAG_EPOCHS = 2
"""Command in epoch k, change in k + 1: a satellite may be on the wrong antenna, or past the mask, so long."""


@pytest.fixture(scope="module", params=["soyuz", "soyuz-roll", "soyuz-l1l2"])
def epochs(request, tmp_path_factory):
    return flown(request.param, tmp_path_factory)


def flown(scenario, tmp_path_factory, *options):
    out = tmp_path_factory.mktemp("run") / "out"
    command = [
        *GNSS_HIL,
        "run",
        scenario,
        "--duration",
        "700",
        "--bus",
        "inline",
    ]
    subprocess.run([*command, "--out", str(out), *options], check=True, capture_output=True)
    return buslog.read(out / "bus.log", DBC)


def rotate(q, v):
    """v_body = C(q) v_ecef for a passive Hamilton quaternion, written out."""
    w, x, y, z = q
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z),
    )
    return [sum(a * b for a, b in zip(row, v, strict=True)) for row in rows]


def angle_deg(a, b) -> float:
    cross = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return math.degrees(math.atan2(math.hypot(*cross), sum(x * y for x, y in zip(a, b, strict=True))))


def angles_to_boresights(epoch, satellite_ecef) -> dict[int, float]:
    """Angle off each antenna's boresight [deg], by receiver."""
    s = epoch.signals
    here = [s[f"NAV_{axis}"][f"{axis.lower()}_m"] for axis in "XYZ"]
    q = [s["ATT_Q01"]["q0"], s["ATT_Q01"]["q1"], s["ATT_Q23"]["q2"], s["ATT_Q23"]["q3"]]
    los_body = rotate(q, [a - b for a, b in zip(satellite_ecef, here, strict=True)])
    return {a["receiver"]: angle_deg(los_body, a["boresight_body"]) for a in VEHICLE["antenna"]}


def first_assignment_acknowledged(epochs) -> int:
    """Epoch in which the last answer to the first epoch of commands arrived."""
    first = next(e for e in epochs if e.commands)
    waiting = {(r, c["transaction"]) for r, c in first.commands}
    for e in epochs:
        waiting -= {(r, a["transaction"]) for r, a in e.acks}
        if e.number > first.number and not waiting:
            return e.number
    raise AssertionError(f"never acknowledged: {waiting}")


def test_no_satellite_enters_a_fix_from_two_antennas(epochs):
    start = first_assignment_acknowledged(epochs)
    checked = 0
    for e in epochs[start:]:
        used: dict[str, list[tuple[int, str]]] = {}
        for r, k in ((r, k) for r, mask in e.used.items() for k in range(32) if mask >> k & 1):
            used.setdefault(e.satellite(r, k), []).append((r, str(e.channels[r, k]["signal"])))
        for name, channels in used.items():
            assert len({r for r, _ in channels}) == 1, f"epoch {e.number}: {name} on {channels}"
            assert len({signal for _, signal in channels}) == len(channels), f"epoch {e.number}: {name}"
        checked += len(used)
    assert checked > 15 * (len(epochs) - start)


def test_every_commanded_antenna_is_the_one_closest_to_its_axis(epochs):
    masks = {a["receiver"]: a["mask_deg"] for a in VEHICLE["antenna"]}
    almanac: dict[str, tuple[int, dict]] = {}
    seen: set[tuple[int, int]] = set()
    checked = 0
    for e in epochs:
        almanac.update({name: (e.number, row) for name, row in e.almanac.items() if "vx_mps" in row})
        tracked = {buslog.sat_name(row): row for row in e.channels.values() if "sat_number" in row}
        for receiver, command in e.commands:
            key = (receiver, command["transaction"])
            if key in seen or str(command["action"]) != "TRACK":
                continue
            seen.add(key)
            name = buslog.sat_name(command)
            if name in tracked:
                where = [tracked[name][f"{axis}_m"] for axis in "xyz"]
            else:
                number, row = almanac[name]
                where = [row[f"{axis}_m"] + row[f"v{axis}_mps"] * (e.number - number) for axis in "xyz"]
            angles = angles_to_boresights(e, where)
            assert angles[receiver] <= min(angles.values()) + TIE_DEG, f"epoch {e.number} {name}: {angles}"
            assert angles[receiver] <= masks[receiver] + TIE_DEG, f"epoch {e.number} {name}: {angles}"
            checked += 1
    assert checked >= 24


def longest_wrong(epochs) -> int:
    """Most epochs in a row that a satellite of a fix was not on the closest antenna, or past its mask."""
    masks = {a["receiver"]: a["mask_deg"] for a in VEHICLE["antenna"]}
    wrong, longest, checked = Counter(), 0, 0
    for e in epochs[first_assignment_acknowledged(epochs) :]:
        now = Counter()
        for receiver, mask in e.used.items():
            for channel in (k for k in range(32) if mask >> k & 1):
                row = e.channels[receiver, channel]
                angles = angles_to_boresights(e, [row[f"{axis}_m"] for axis in "xyz"])
                allowed = min(min(angles.values()), masks[receiver]) + TIE_DEG
                if angles[receiver] > allowed:
                    name = buslog.sat_name(row)
                    now[name] = wrong[name] + 1
                checked += 1
        wrong = now
        longest = max([longest, *now.values()])
    assert checked > 10_000
    return longest


def test_every_satellite_of_a_fix_is_on_the_antenna_closest_to_it(epochs):
    assert longest_wrong(epochs) <= LAG_EPOCHS


def test_a_flight_software_that_hands_over_late_is_caught(tmp_path_factory):
    """Negative control: 30 deg of hysteresis keep satellites on the wrong antenna."""
    assert longest_wrong(flown("soyuz-roll", tmp_path_factory, "--option", "hysteresis_deg=30")) > LAG_EPOCHS
