"""The sky of a run as files; what is in them, flown, is judged by `tests/system/test_example_sky.py`."""

from __future__ import annotations

import json

import pytest

from gnss_hil.emulator.files import sp3
from gnss_hil.tools.command_line.main import main
from tests.support.exported import played

WRONG = ("--on", "ephemeris_error", "--on", "satellite_clock_error")


@pytest.fixture(scope="module")
def sky(run, tmp_path_factory):
    """The sky of the run without errors, that of a run without a log: none is needed."""
    folder = tmp_path_factory.mktemp("sky")
    (folder / "run").mkdir()
    for name in ("scenario.toml", "vehicle.toml"):
        (folder / "run" / name).write_bytes((run / name).read_bytes())
    assert main(["export", "sky", str(folder / "run"), "--out", str(folder / "files")]) == 0
    return folder / "files"


def flown(folder, *more: str) -> dict:
    played(folder, "--off", "all", *more)
    return json.loads((folder / "summary.json").read_text())["craft"]["soyuz"]


def test_a_sky_without_errors_is_its_own_truth(sky, tmp_path):
    """Orbits are of centres of mass, clocks of two carriers: back at the antenna they agree with messages."""
    files = "--nav", str(sky / "broadcast.nav"), "--sp3", str(sky / "orbits.sp3")
    found = flown(tmp_path / "run", *files)
    assert found["fixes"] > 40
    assert found["position_error_m"]["median"] < 0.02


def test_the_orbits_say_what_they_are(sky):
    text = (sky / "orbits.sp3").read_text()
    assert "made-up sky" in text and "made-up sky" in (sky / "broadcast.nav").read_text()
    found = sp3.read(sky / "orbits.sp3")
    assert len(found.name) == 48 and set(text.splitlines()[1].split()) >= {"300.00000000"}


def test_a_sky_of_files_is_one_already(sky, tmp_path, capsys):
    files = "--nav", str(sky / "broadcast.nav"), "--sp3", str(sky / "orbits.sp3")
    for more in (files, files[:2]):
        folder = played(tmp_path / str(len(more)), *more)
        capsys.readouterr()
        assert main(["export", "sky", str(folder)]) == 2
        shown = capsys.readouterr().err
        assert shown == "gnss-hil: soyuz: its sky is of files already; export sky writes nominal ones\n"


def test_messages_of_a_wrong_sky_are_as_wrong_as_what_was_on_the_bus(tmp_path, capsys):
    """`export rinex` holds its records against the bus, and complains of 0.2 m."""
    folder = played(tmp_path / "wrong", *WRONG)
    capsys.readouterr()
    assert main(["export", "rinex", str(folder)]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    (apart_mm,) = [float(line.split()[-6]) for line in shown.out.splitlines() if "from the bus" in line]
    assert apart_mm < 30
