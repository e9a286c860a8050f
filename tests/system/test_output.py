"""What the program does where its output cannot go, and what its help says."""

from __future__ import annotations

import os
import resource
import subprocess
from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import COMMANDS, main
from tests.support.programs import PROGRAM
from tests.support.waiting import HANG_S


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("command", ["icd dbc", "icd hash", "--help"])
def test_no_room_for_the_output_is_one_line(command, desk):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [PROGRAM, *command.split()], stdout=full, stderr=subprocess.PIPE, text=True, timeout=HANG_S
        )
    assert done.returncode == 1
    assert done.stderr == "gnss-hil: standard output: No space left on device\n"


def run_within(room: int, command: list[str]) -> subprocess.CompletedProcess[str]:
    """A command none of whose files may grow beyond `room` octets.

    It writes no bytecode: Python 3.11 takes a file that found half its room for a whole one, and every later
    process of the installation would read it.
    """

    def short_of_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    return subprocess.run(
        command, capture_output=True, text=True, timeout=HANG_S, preexec_fn=short_of_room,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("command", "file"),
    [
        ("icd html --out page.html", "page.html"),
        ("schema vehicle --out schemas", "schemas/vehicle.schema.json"),
    ],
)
def test_no_room_for_a_file_names_it(command, file, desk):
    done = run_within(1000, [PROGRAM, *command.split()])
    assert (done.returncode, done.stderr) == (1, f"gnss-hil: {file}: File too large\n")


def test_no_room_for_the_record_names_the_run_folder(desk):
    done = run_within(200_000, [PROGRAM, "run", "--bus", "inline", "--quiet", "--out", "run"])
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "gnss-hil: run: File too large"
    again = subprocess.run([PROGRAM, "report", "run"], capture_output=True, text=True, timeout=HANG_S)
    (told,) = (line for line in again.stdout.splitlines() if line.startswith("NOT COMPLETE"))
    assert told.endswith("of 600 epochs: run: File too large") and " epochs (failed)" in again.stdout
    assert again.stderr == f"gnss-hil: note: failed {told.partition('failed ')[2]}\n"


def test_no_room_for_a_page_leaves_none_that_looks_new(desk):
    command = [PROGRAM, "run", "--bus", "inline", "--duration", "3", "--quiet", "--out", "run"]
    subprocess.run(command, check=True, capture_output=True, timeout=HANG_S)
    done = run_within(100_000, [PROGRAM, "report", "run"])
    assert done.returncode == 1
    assert done.stderr.endswith(
        "the figures are in summary.json, the page run/report.html is of an earlier report\n"
    )


def test_a_quiet_run_has_its_summary_and_nothing_else(desk):
    """Programs read figures from it; what is wrong or odd is on the other stream."""
    command = [PROGRAM, "run", "--bus", "inline", "--duration", "3", "--quiet", "--no-report", "--out", "run"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S)
    assert (done.returncode, done.stderr) == (0, "")
    assert "  satellites in view " in done.stdout and done.stdout.endswith("run folder: run\n")
    command = [PROGRAM, "convert", "run", "run.asc", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S)
    assert done.stdout.startswith("run.asc: ") and done.stderr == ""


def test_a_reader_that_leaves_is_no_fault(desk):
    done = subprocess.run(
        ["sh", "-c", f"{{ {PROGRAM} icd dbc; echo $? >&2; }} | head -c 1"],
        capture_output=True, text=True, timeout=HANG_S,
    )  # fmt: skip
    assert (len(done.stdout), done.stderr) == (1, "0\n")


@pytest.mark.parametrize(("argv", "status"), [("icd hash", 0), ("rum", 2), ("run --bus inline", 0)])
def test_with_stderr_closed_it_works_all_the_same(argv, status, desk):
    more = "--duration 2" if argv.startswith("run") else ""
    done = subprocess.run(
        ["sh", "-c", f"{PROGRAM} {argv} {more} 2>&-"], capture_output=True, text=True, timeout=HANG_S
    )
    assert done.returncode == status
    assert bool(done.stdout) == (status == 0)


def test_help_of_every_command_has_examples(desk, capsys):
    for name in COMMANDS:
        assert main([name, "--help"]) == 0
        assert f"gnss-hil {name}" in capsys.readouterr().out.split("examples:")[1]
