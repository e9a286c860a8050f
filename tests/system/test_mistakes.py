"""Mistakes of people: each gets its one line and exit status, no traceback, and leaves nothing behind."""

from __future__ import annotations

import gzip
import re
import resource
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from dbc.vehicle import find
from emulator.scenario import shipped
from tools.cli import main

SOYUZ = shipped()["soyuz"].read_text("utf-8")
VEHICLE = find("soyuz-ms").read_text("utf-8")
PROGRAM = shutil.which("gnss-hil", path=str(Path(sys.executable).parent))
RINEX = """\
     2.11           N: GPS NAV DATA                         RINEX VERSION / TYPE
                                                            END OF HEADER
 7 12 10 31  0  0  0.0 1.234567890123D-04 1.136868377216D-12 0.000000000000D+00
    5.900000000000D+01-2.140625000000D+01 4.562332847200D-09-1.044153432262D+00
   -1.104548573494D-06 6.987643428147D-03 7.838010787964D-06 5.153706756592D+03
    2.592000000000D+05-1.192092895508D-07 2.129861043280D+00 1.117587089539D-08
    9.680073495890D-01 2.311250000000D+02-2.933458333333D+00-8.140339082310D-09
"""


@dataclass(frozen=True)
class Mistake:
    """A command line, the one line it gets (regular expression), the exit status."""

    name: str
    argv: str
    line: str
    status: int


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
        "boresight_body = [1, 0, -1]",
    ),
    "mask": ("mask_deg = 85.0", "mask_deg = 185.0"),
    "channels": ("channels = 6", "channels = 60"),
}

MISTAKES = r"""
[2]
no such command
    $ rum
    unknown command 'rum'; did you mean 'run'\?
no such option
    $ run --polcy patent
    unrecognized arguments: --polcy
no such scenario
    $ run sojuz
    scenario 'sojuz': not found; shipped are .*soyuz
scenario file missing
    $ run nowhere.toml
    nowhere\.toml: No such file or directory
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
negative duration in the file
    $ run {negative}.toml
    time\.duration_s: .*greater than 0, found -600
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
    policy 'patent': hysterisis_deg: unknown key
vehicle of the file missing
    $ run {no_vehicle}.toml
    vehicle 'sojuz-ms\.toml': no such file; shipped are .*soyuz-ms
unknown figure expected
    $ run {expectation}.toml
    expect\.soyuz\.satelites\.mean: no such figure
negative duration
    $ run --duration -5
    --duration: -5 s; must be greater than 0
zero duration
    $ run --duration 0
    --duration: 0 s; must be greater than 0
duration of nothing
    $ run --duration nan
    --duration: nan s; must be greater than 0
duration in an unknown unit
    $ run --duration 5parsec
    '5parsec' is not a duration
duration beyond limits
    $ run --duration 90d
    time\.duration_s: .*less than or equal to 2678400
interval too short
    $ run --interval 0.001
    epoch_interval_s: .*greater than or equal to 0\.01
bus would overflow
    $ run --interval 0.03
    the bus would overflow: \d+ frames .* \d+ % .*allowed 80 %
unknown policy
    $ run --policy nearest
    policy 'nearest': not known; there are patent, prototype, analogue, single
unknown option
    $ run --option foo=1
    policy 'patent': foo: unknown key
option out of range
    $ run --option hysteresis_deg=-1
    hysteresis_deg: .*found -1
option without value
    $ run --option overflow
    'overflow': not of the form KEY=VALUE
option twice
    $ run --option hysteresis_deg=1 --option hysteresis_deg=2
    given 2 times
option of the other policy
    $ run --policy prototype --option overflow=next
    overflow: unknown key
unknown rule
    $ run --autonomous chance
    --autonomous: invalid choice: 'chance'.*elevation
factor that there is not
    $ run --off troposphere
    --off: invalid choice: 'troposphere'.*code_noise
seed not whole
    $ run --seed 1.5
    --seed: '1\.5': a whole number from 0
unknown pace
    $ run --pace fast
    pace 'fast': not one of lockstep, realtime, xN
pace without a clock
    $ run --bus inline --pace x2
    --pace x2 with --bus inline
bus without channel
    $ run --bus socketcan
    --bus: 'socketcan': not one of
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
    boresight_body has length 1\.414
mask too wide
    $ run --vehicle {mask}.toml
    mask_deg: .*less than or equal to 180, found 185
too many channels
    $ run --vehicle {channels}.toml
    channels: .*less than or equal to 32, found 60
run folder taken
    $ run --out {taken}
    --out .*taken: exists and is not an empty folder
run folder cannot be
    $ run --out {empty}.12n/run
    --out .*: cannot be written: Not a directory
flight software that there is not
    $ run --flight nosuch
    --flight 'nosuch': no such program
flight software with an open quotation
    $ run --flight sh'unclosed
    --flight .*'unclosed.*: not a command: No closing quotation
flight software without a bus
    $ run --flight external --bus inline
    --flight external with --bus inline: inline has no bus to join
policy for somebody else's flight software
    $ run --flight external --policy patent
    --policy with --flight external: it belongs to our own flight software
verdict into a folder that there is not
    $ run --junit nowhere/verdict.xml
    --junit nowhere/verdict\.xml: no such folder nowhere
verdict into a folder itself
    $ run --junit {taken}
    --junit .*taken: is a folder; name a file
report of nothing
    $ report nowhere
    nowhere: no such run folder
report without scenario
    $ report {taken}
    taken: has no scenario\.toml
nine receivers
    $ icd dbc --receivers 9
    --receivers: 9 receivers; a contract has 1 to 8
vcan without command
    $ vcan shell
    vcan shell: no command
[3]
absent CAN interface
    $ run --bus socketcan:vcan77
    socketcan:vcan77
absent python-can interface
    $ run --bus nosuch:0
    nosuch
no bench at the socket
    $ fly --vehicle {vehicle}.toml --bus embedded:/nowhere/bus
    No such file
"""
"""By exit status: what somebody does, the command with {names} of prepared files, the line it gets."""


def _table() -> list[Mistake]:
    rows, status = [], 0
    lines = iter(MISTAKES.strip().splitlines())
    for line in lines:
        if line.startswith("["):
            status = int(line[1])
        else:
            rows.append(Mistake(line, next(lines).strip().removeprefix("$ "), next(lines).strip(), status))
    return rows


TABLE = _table()


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Path:
    """A folder with every file the table needs."""
    folder = tmp_path_factory.mktemp("mistakes")
    for name, (old, new) in CHANGES.items():
        (folder / f"{name}.toml").write_text(changed(SOYUZ, old, new))
    for name, (old, new) in VEHICLE_CHANGES.items():
        (folder / f"{name}.toml").write_text(changed(VEHICLE, old, new))
    (folder / "vehicle.toml").write_text(VEHICLE)
    noise = bytes(range(256)) * 8
    for name in ("binary.toml", "binary.12n"):
        (folder / name).write_bytes(noise)
    (folder / "empty.12n").touch()
    (folder / "truncated.12n").write_text(RINEX)
    (folder / "not.gz").write_text(RINEX)
    (folder / "cut.gz").write_bytes(gzip.compress(RINEX.encode())[:-40])
    (folder / "taken").mkdir()
    (folder / "taken" / "thesis.txt").write_text("precious")
    return folder


@pytest.fixture
def desk(bench, tmp_path, monkeypatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def argv_of(mistake: Mistake, folder: Path) -> list[str]:
    return [re.sub(r"\{(\w+)\}", lambda m: str(folder / m[1]), word) for word in mistake.argv.split()]


def test_the_table_is_long_enough_and_has_no_double():
    assert len({m.name for m in TABLE}) == len(TABLE) >= 30


@pytest.mark.parametrize("mistake", TABLE, ids=lambda m: m.name.replace(" ", "-"))
def test_a_mistake_gets_its_line_and_status(mistake, bench, desk, capsys):
    before = {path: path.stat().st_mtime_ns for path in bench.rglob("*")}
    status = main(argv_of(mistake, bench))
    said = capsys.readouterr()
    lines = said.err.splitlines()
    assert status == mistake.status
    assert said.out == ""
    assert len(lines) == 1, said.err
    assert re.search(mistake.line, lines[0]), lines[0]
    assert list(desk.iterdir()) == []
    assert {path: path.stat().st_mtime_ns for path in bench.rglob("*")} == before


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


@pytest.mark.parametrize(
    ("argv", "status", "line"),
    [
        (["run", "--duration", "-1"], 2, "gnss-hil: --duration: -1 s; must be greater than 0"),
        (["run", "--bus", "socketcan:vcan77"], 3, "gnss-hil: bus 'socketcan:vcan77'"),
        (["nonsense"], 2, "gnss-hil: unknown command 'nonsense'"),
    ],
    ids=["usage", "environment", "command"],
)  # fmt: skip
def test_the_program_itself_says_it_too(argv, status, line, desk):
    done = subprocess.run([PROGRAM, *argv], capture_output=True, text=True, timeout=30)
    assert done.returncode == status
    assert done.stdout == ""
    assert done.stderr.startswith(line) and done.stderr.count("\n") == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("command", ["icd dbc", "icd hash", "--help"])
def test_no_room_for_the_output_is_one_line(command, desk):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [PROGRAM, *command.split()], stdout=full, stderr=subprocess.PIPE, text=True, timeout=30
        )
    assert done.returncode == 1
    assert done.stderr == "gnss-hil: standard output: No space left on device\n"


def test_no_room_for_the_record_names_the_run_folder(desk):
    def short_of_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

    command = [PROGRAM, "run", "--bus", "inline", "--quiet", "--out", "run"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, preexec_fn=short_of_room)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "gnss-hil: run: File too large"


def test_a_reader_that_leaves_is_no_fault(desk):
    done = subprocess.run(
        ["sh", "-c", f"{{ {PROGRAM} icd dbc; echo $? >&2; }} | head -c 1"],
        capture_output=True, text=True, timeout=30,
    )  # fmt: skip
    assert (len(done.stdout), done.stderr) == (1, "0\n")


@pytest.mark.parametrize(("argv", "status"), [("icd hash", 0), ("rum", 2), ("run --bus inline", 0)])
def test_with_stderr_closed_it_works_all_the_same(argv, status, desk):
    more = "--duration 2" if argv.startswith("run") else ""
    done = subprocess.run(
        ["sh", "-c", f"{PROGRAM} {argv} {more} 2>&-"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == status
    assert bool(done.stdout) == (status == 0)


def test_help_of_every_command_has_examples(desk, capsys):
    from tools.cli import COMMANDS

    for name in COMMANDS:
        assert main([name, "--help"]) == 0
        assert f"gnss-hil {name}" in capsys.readouterr().out.split("examples:")[1]
