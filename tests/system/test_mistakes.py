"""Mistakes at the command line: one line and one exit status each, no traceback, nothing left behind."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.tools.command_line.main import main
from tests.support.mistakes import gets_its_line_and_status, label, table
from tests.support.programs import PROGRAM
from tests.support.waiting import HANG_S

pytestmark = [
    pytest.mark.verifies(
        "emulator/config/scenario.py",
        "emulator/config/tables.py",
        what="Scenario files",
        by="form and ranges are ours; every mistake is one line",
        status="modelled",
    ),
    pytest.mark.verifies(
        "tools/command_line/arguments.py",
        "tools/run_config/plan.py",
        "tools/recording/run_folder.py",
        "tools/run_config/recorded_receiver.py",
        "tools/run_config/config.py",
        "tools/run_config/overrides.py",
        what="What a run will be: arguments, plan, folder",
        by="rules of ours; a run folder repeats its run",
        status="modelled",
    ),
]

TABLE = table(r"""
[2]
no such command
    $ rum
    unknown command 'rum'; did you mean 'run'\?
no such option
    $ run --polcy patent
    unrecognized arguments: --polcy; did you mean '--policy'\?
no such factor
    $ run --on code_nose
    --on: invalid choice: 'code_nose' .*did you mean 'code_noise'\?
no such key set
    $ run --set craft.0.orbit.altitud_km=500
    --set craft\.0\.orbit\.altitud_km: .*did you mean 'craft\.0\.orbit\.altitude_km'\?
a key without a value
    $ run --set craft.0.orbit.altitude_km
    --set: 'craft\.0\.orbit\.altitude_km': not of the form KEY=VALUE
emulator that waits for nothing
    $ emulate --bus embedded:/nowhere/bus --wait nan
    --wait: nan s; must be finite and greater than 0
emulator of a key that is not there
    $ emulate --bus embedded:/nowhere/bus --set time.durration_s=5
    --set time\.durration_s: .*did you mean 'time\.duration_s'\?
emulator whose bus would overflow
    $ emulate --bus embedded:/nowhere/bus --interval 0.02
    soyuz: the bus would overflow
emulator in a session beyond 16 bits
    $ emulate --bus embedded:/nowhere/bus --session 65536
    --session: '65536': a whole number from 1 to 65535
wait for nobody
    $ run --bus inline --wait 5
    --wait with --bus inline: both sides are one process
negative duration
    $ run --duration -5
    --duration: -5 s; must be finite and greater than 0
zero duration
    $ run --duration 0
    --duration: 0 s; must be finite and greater than 0
duration of nothing
    $ run --duration nan
    --duration: nan s; must be finite and greater than 0
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
    foo: unknown option; there are .*overflow
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
    overflow: unknown option; there are 
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
run shorter than an epoch
    $ run --interval 1m --duration 30
    --duration: time: duration_s is 30, epoch_interval_s 60: a run has at least one epoch
bus without channel
    $ run --bus socketcan
    --bus: 'socketcan': not one of
bus without its interface
    $ run --bus vcan0
    --bus: 'vcan0': .*did you mean 'socketcan:vcan0'\?
bus of a name with a slip
    $ run --bus embeded
    --bus: 'embeded': .*did you mean 'embedded'\?
interface with a slip
    $ run --bus socketcn:vcan0
    bus 'socketcn:vcan0': no interface 'socketcn'; did you mean 'socketcan'\?
interface with a slip, for the flight software
    $ fly --vehicle {vehicle}.toml --bus socketcn:vcan0
    bus 'socketcn:vcan0': no interface 'socketcn'; did you mean 'socketcan'\?
bus without its interface, for the flight software
    $ fly --vehicle {vehicle}.toml --bus vcan0
    bus 'vcan0': not of the form INTERFACE:CHANNEL; did you mean 'socketcan:vcan0'\?
interface with a slip, for the emulator
    $ emulate --bus socketcn:vcan0
    no interface 'socketcn'; did you mean 'socketcan'\?
interface with a slip, for the monitor
    $ monitor --bus socketcn:vcan0
    no interface 'socketcn'; did you mean 'socketcan'\?
interface that there is not
    $ run --bus nosuch:0
    no interface 'nosuch'; allowed are .*socketcan
scenario that is a folder
    $ run {taken}
    taken: is a folder
vehicle that is a folder
    $ run --vehicle {taken}
    vehicle '.*taken': is a folder
run folder taken
    $ run --out {taken}
    --out .*taken: exists and is not an empty folder
run folder cannot be
    $ run --out {empty}.12n/run
    --out .*: cannot be written: Not a directory
flight software that there is not
    $ run --flight nosuch
    --flight 'nosuch': no such program
flight software that is not executable
    $ run --flight {empty}.12n
    --flight '.*': .*empty.12n is not executable; name what runs it before it
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
report of a file
    $ report {vehicle}.toml
    vehicle\.toml: is a file; name the run folder
report without scenario
    $ report {taken}
    taken: is no run folder: it has no scenario\.toml
recording that there is not
    $ convert nowhere out.blf
    nowhere: no such run folder or recording
recording of a folder without one
    $ convert {taken} out.blf
    taken: is no run folder: it has no bus\.log
document into a folder that there is not
    $ icd html --out nowhere/icd.html
    --out nowhere/icd\.html: no such folder nowhere
schemas into a file
    $ schema --out {vehicle}.toml
    --out .*vehicle\.toml: is a file; name a folder
study into a folder that is taken
    $ study factors --out {taken}
    --out .*taken: exists and is not an empty folder; --force overwrites what is in it
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
no bench at the socket
    $ fly --vehicle {vehicle}.toml --bus embedded:/nowhere/bus
    No such file
""")


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Path:
    """A folder with every file the table needs."""
    folder = tmp_path_factory.mktemp("mistakes")
    (folder / "vehicle.toml").write_text(find("soyuz-ms").read_text("utf-8"))
    (folder / "empty.12n").touch()
    (folder / "taken").mkdir()
    (folder / "taken" / "thesis.txt").write_text("precious")
    return folder


def test_a_run_folder_in_the_place_of_a_scenario_names_its_scenario(desk, capsys):
    (desk / "old").mkdir()
    (desk / "old" / "scenario.toml").touch()
    assert main(["run", "old"]) == 2
    assert capsys.readouterr().err == "gnss-hil: old: is a folder; its scenario is old/scenario.toml\n"


def test_all_files_that_are_missing_are_named_at_once(desk, capsys):
    assert main("run replay --obs day.10o --sp3 a.sp3 --sp3 b.sp3 --nav c.nav --reference d.oem".split()) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 5 and all("No such file or directory" in line for line in said)


def test_a_run_longer_than_was_asked_for_says_so(desk, capsys):
    assert main("run --interval 60 --duration 90 --bus inline --quiet --no-report --no-log".split()) == 0
    said = "duration_s 90 is no whole number of epochs of 60 s: 120 s are played"
    assert capsys.readouterr().err == f"gnss-hil: {said}\n"


@pytest.mark.parametrize(
    "words",
    [
        "icd budget --debug soyuz",
        "icd html --receivers 4 soyuz --out page.html",
        "schema --out . scenario",
        "faults check --scenario soyuz replay",
        "faults --scenario soyuz check replay",
        "run --bus inline soyuz --duration 2 --quiet",
    ],
)
def test_options_may_stand_anywhere(words, desk):
    assert main(words.split()) == 0


def test_the_table_is_long_enough_and_has_no_double():
    assert len({m.name for m in TABLE}) == len(TABLE) >= 30


@pytest.mark.parametrize("mistake", TABLE, ids=label)
def test_a_mistake_gets_its_line_and_status(mistake, bench, desk, capsys):
    gets_its_line_and_status(mistake, bench, desk, capsys)


@pytest.mark.parametrize(
    ("argv", "status", "line"),
    [
        (["run", "--duration", "-1"], 2, "gnss-hil: --duration: -1 s; must be finite and greater than 0"),
        (["run", "--bus", "socketcan:vcan77"], 3, "gnss-hil: bus 'socketcan:vcan77'"),
        (["nonsense"], 2, "gnss-hil: unknown command 'nonsense'"),
    ],
    ids=["usage", "environment", "command"],
)  # fmt: skip
def test_the_program_itself_says_it_too(argv, status, line, desk):
    done = subprocess.run([PROGRAM, *argv], capture_output=True, text=True, timeout=HANG_S)
    assert done.returncode == status
    assert done.stdout == ""
    assert done.stderr.startswith(line) and done.stderr.count("\n") == 1
