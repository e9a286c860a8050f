"""Scenarios, vehicle files and navigation files with one thing wrong: each gets its one line and status."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main
from tests.support.mistakes import gets_its_line_and_status, label, table

SOYUZ = shipped()["soyuz"].read_text("utf-8")
VEHICLE = find("soyuz-ms").read_text("utf-8")
RINEX = """\
     2.11           N: GPS NAV DATA                         RINEX VERSION / TYPE
                                                            END OF HEADER
 7 12 10 31  0  0  0.0 1.234567890123D-04 1.136868377216D-12 0.000000000000D+00
    5.900000000000D+01-2.140625000000D+01 4.562332847200D-09-1.044153432262D+00
   -1.104548573494D-06 6.987643428147D-03 7.838010787964D-06 5.153706756592D+03
    2.592000000000D+05-1.192092895508D-07 2.129861043280D+00 1.117587089539D-08
    9.680073495890D-01 2.311250000000D+02-2.933458333333D+00-8.140339082310D-09
"""


def changed(text: str, old: str, new: str) -> str:
    assert old in text, old
    return text.replace(old, new, 1)


CRAFT = SOYUZ[SOYUZ.index("[[craft]]") :]
CHANGES = {  # scenarios with one thing wrong: (old, new)
    "unknown_key": ('gps = "nominal"', 'gsp = "nominal"'),
    "unknown_unit": ("duration_s = 600", "duration_min = 10"),
    "unknown_factor": ("[craft.flight]", "[craft.factors]\ntroposphere = true\n[craft.flight]"),
    "policy": ('policy = "patent"', 'policy = "patnet"'),
    "option": ('policy = "patent"', 'policy = "patent"\noptions = {hysterisis_deg = 2}'),
    "orbit_twice": ("altitude_km = 415", "altitude_km = 415, semi_major_axis_km = 6793"),
    "orbit_none": ("altitude_km = 415, ", ""),
    "underground": ("altitude_km = 415", "altitude_km = 415, eccentricity = 0.2"),
    "negative": ("duration_s = 600", "duration_s = -600"),
    "text": ("duration_s = 600", 'duration_s = "ten minutes"'),
    "number_in_quotes": ("duration_s = 600", 'duration_s = "600"'),
    "whole_in_quotes": ("seed = 1", 'seed = "1"'),
    "switch_for_number": ("duration_s = 600", "duration_s = true"),
    "switch_in_quotes": ("[craft.flight]", '[craft.factors]\ncode_noise = {enabled = "yes"}\n[craft.flight]'),
    "before_gps": ("2012-10-31T00:15:00", "1970-01-01T00:00:00"),
    "zone": ("2012-10-31T00:15:00", "2012-10-31T00:15:00+03:00"),
    "nothing_above": ('gps = "nominal"\nglonass = "nominal"', 'gps = "none"\nglonass = "none"'),
    "no_craft": (CRAFT, ""),
    "twins": (CRAFT, CRAFT + CRAFT),
    "slew": ('mode = "lvlh"', 'mode = "slew"'),
    "no_vehicle": ("soyuz-ms.toml", "sojuz-ms.toml"),
    "expectation": ("[time]", '[expect]\n"soyuz.satelites.mean" = {min = 23}\n[time]'),
    "broken": ("[time]", "[time"),
}
VEHICLE_CHANGES = {
    "receivers_clash": ("receiver = 2", "receiver = 1"),
    "direction": (
        "boresight_body = [0.573576436351046, 0.0, -0.819152044288992]",
        "boresight_body = [0, 0, 0]",
    ),
    "mask": ("mask_deg = 85.0", "mask_deg = 185.0"),
    "channels": ("channels = 6", "channels = 60"),
    "channels_in_quotes": ("channels = 6", 'channels = "6"'),
}

TABLE = table(r"""
[2]
no such scenario
    $ run sojuz
    scenario 'sojuz': not found; shipped are .*soyuz
scenario file missing
    $ run nowhere.toml
    nowhere\.toml: No such file or directory
shipped scenario as a file
    $ run soyuz.toml
    soyuz\.toml: No such file or directory; did you mean 'soyuz'\?
scenario is binary
    $ run {binary}.toml
    binary\.toml: not UTF-8 text
scenario is not TOML
    $ run {broken}.toml
    broken\.toml: not TOML: .*line \d+
unknown key
    $ run {unknown_key}.toml
    unknown_key\.toml: sky\.gsp: unknown key
unknown unit
    $ run {unknown_unit}.toml
    time\.duration_min: unknown key
unknown factor
    $ run {unknown_factor}.toml
    craft\.0\.factors\.troposphere: unknown key
text for a number
    $ run {text}.toml
    time\.duration_s: .*number.*found 'ten minutes'
number in quotes
    $ run {number_in_quotes}.toml
    time\.duration_s: .*valid number, found '600'
whole number in quotes
    $ run {whole_in_quotes}.toml
    seed: .*valid integer, found '1'
switch for a number
    $ run {switch_for_number}.toml
    time\.duration_s: .*valid number, found True
switch in quotes
    $ run {switch_in_quotes}.toml
    craft\.0\.factors\.code_noise\.enabled: .*valid boolean, found 'yes'
negative duration in the file
    $ run {negative}.toml
    time\.duration_s: .*greater than 0, found -600
start before GPS
    $ run {before_gps}.toml
    time\.start_gps: must be from 1980-01-06 until 2100-01-01, found '1970-01-01T00:00:00'
start in a time zone
    $ run {zone}.toml
    time\.start_gps: must be written without an offset
two orbit sizes
    $ run {orbit_twice}.toml
    orbit needs one of semi_major_axis_km and altitude_km
no orbit size
    $ run {orbit_none}.toml
    orbit needs one of semi_major_axis_km and altitude_km
orbit inside the Earth
    $ run {underground}.toml --bus inline
    perigee
nothing to receive
    $ run {nothing_above}.toml
    gps and glonass are both 'none'
no craft
    $ run {no_craft}.toml
    craft: missing
craft of one name
    $ run {twins}.toml
    craft names are \['soyuz', 'soyuz'\]; each must be different
slew without profile
    $ run {slew}.toml
    profile goes with mode 'slew'
unknown policy in the file
    $ run {policy}.toml
    policy 'patnet': not known; there are .*patent
unknown option in the file
    $ run {option}.toml
    policy 'patent', navigator 'all_in_view': hysterisis_deg: unknown option; there are .*hysteresis_deg
vehicle of the file missing
    $ run {no_vehicle}.toml
    vehicle 'sojuz-ms\.toml': no such file; shipped are .*soyuz-ms
unknown figure expected
    $ run {expectation}.toml
    expect\.soyuz\.satelites\.mean: no such figure
navigation file missing
    $ run --nav missing.12n
    --nav: missing\.12n: No such file
navigation file empty
    $ run --nav {empty}.12n
    --nav: .*empty\.12n: .*(empty|not a RINEX)
navigation file binary
    $ run --nav {binary}.12n
    --nav: .*binary\.12n
navigation file truncated
    $ run --nav {truncated}.12n
    --nav: .*truncated\.12n: .*line \d+
navigation file not gzip
    $ run --nav {not}.gz
    --nav: .*not\.gz
navigation file cut gzip
    $ run --nav {cut}.gz
    --nav: .*cut\.gz
navigation folder
    $ run --nav .
    --nav: .*directory
vehicle missing
    $ run --vehicle nowhere.toml
    vehicle 'nowhere.toml': no such file; shipped are
antennas contradict
    $ run --vehicle {receivers_clash}.toml
    antenna receivers are \[1, 1, 3, 4\]; each of 1 to 4 once
boresight no direction
    $ run --vehicle {direction}.toml
    boresight_body has length 0; it points nowhere
mask too wide
    $ run --vehicle {mask}.toml
    mask_deg: .*less than or equal to 180, found 185
too many channels
    $ run --vehicle {channels}.toml
    channels: .*less than or equal to 32, found 60
number of a vehicle in quotes
    $ run --vehicle {channels_in_quotes}.toml
    antenna\.0\.channels: .*valid integer, found '6'
""")


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Path:
    """A folder with every file the table needs."""
    folder = tmp_path_factory.mktemp("mistakes")
    for name, (old, new) in CHANGES.items():
        (folder / f"{name}.toml").write_text(changed(SOYUZ, old, new))
    for name, (old, new) in VEHICLE_CHANGES.items():
        (folder / f"{name}.toml").write_text(changed(VEHICLE, old, new))
    noise = bytes(range(256)) * 8
    for name in ("binary.toml", "binary.12n"):
        (folder / name).write_bytes(noise)
    (folder / "empty.12n").touch()
    (folder / "truncated.12n").write_text(RINEX)
    (folder / "not.gz").write_text(RINEX)
    (folder / "cut.gz").write_bytes(gzip.compress(RINEX.encode())[:-40])
    return folder


def test_the_table_is_long_enough_and_has_no_double():
    assert len({m.name for m in TABLE}) == len(TABLE) >= 30


@pytest.mark.parametrize("mistake", TABLE, ids=label)
def test_a_mistake_gets_its_line_and_status(mistake, bench, desk, capsys):
    gets_its_line_and_status(mistake, bench, desk, capsys)


def test_all_faults_of_a_file_are_told_at_once(bench, desk, capsys):
    text = changed(
        changed(SOYUZ, "duration_s = 600", "duration_s = 0"),
        "inclination_deg = 51.6",
        "inclination_deg = 200",
    )
    Path("two.toml").write_text(text)
    assert main(["run", "two.toml"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "time.duration_s" in lines[0] and "inclination_deg" in lines[1]
