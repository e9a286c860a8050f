"""`gnss-hil export`: files, and mistakes in one line."""

from __future__ import annotations

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.exported import played


@pytest.mark.verifies(
    "tools/export/orbit_files.py",
    what="Files of gnss-hil export oem and sp3",
    by="names and kinds of the files that come out of a run; what is in them, by the packages oem and sp3",
    status="modelled",
)
def test_files_go_where_they_are_wanted(run, tmp_path, capsys):
    assert main(["export", "rinex", str(run), "--out", str(tmp_path / "new" / "rinex")]) == 0
    assert main(["export", "oem", str(run), "--truth", "--out", str(tmp_path)]) == 0
    assert main(["export", "sp3", str(run), "--out", str(tmp_path)]) == 0
    names = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    antennas = {f"new/rinex/soyuz_{name}.obs" for name in ("fore", "starboard", "aft", "port")}
    others = {"new/rinex/soyuz.obs", "new/rinex/broadcast.nav", "new/rinex/satellites.sp3"}
    assert names == antennas | others | {"soyuz.oem", "soyuz.sp3"}
    assert capsys.readouterr().err == ""


def test_what_is_there_is_overwritten_only_when_asked(run, tmp_path, capsys):
    arguments = ["export", "oem", str(run), "--truth", "--out", str(tmp_path)]
    (tmp_path / "soyuz.oem").write_text("mine")
    assert main(arguments) == 2
    assert capsys.readouterr().err == f"gnss-hil: {tmp_path}/soyuz.oem: exists; --force overwrites\n"
    assert (tmp_path / "soyuz.oem").read_text() == "mine"
    assert main([*arguments, "--force"]) == 0
    assert (tmp_path / "soyuz.oem").read_text() != "mine"


def test_a_sky_and_observations_of_a_run_lie_apart(tmp_path):
    """Both have a broadcast.nav: one in PZ-90, to be flown again, one in WGS-84, for other programs."""
    folder = played(tmp_path / "run")
    for kind in ("sky", "rinex"):
        assert main(["export", kind, str(folder)]) == 0
    skies = {path.parent.name: path.read_text() for path in folder.rglob("broadcast.nav")}
    assert set(skies) == {"sky", "export"} and skies["sky"] != skies["export"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["export", "rinex", "{none}"], "no such run folder"),
        (["export", "rinex", "{empty}"], "has no scenario.toml"),
        (["export", "oem", "{logless}"], "has no bus.log"),
        (["export", "gpx", "{run}"], "invalid choice: 'gpx'"),
        (["export", "oem", "{run}", "--pz90"], "--pz90 belongs to export rinex"),
        (["export", "rinex", "{run}", "--truth"], "--truth belongs to export oem and sp3"),
        (["export", "sp3", "{run}", "--out", "{file}"], "is a file"),
        (["export", "oem", "{blind}", "--truth"], "has no truth"),
        (["export", "sky", "{none}"], "no such run folder"),
        (["export", "sky", "{run}", "--truth"], "--truth belongs to export oem and sp3"),
        (["export", "sky", "{run}", "--pz90"], "--pz90 belongs to export rinex"),
    ],
)
def test_a_mistake_is_one_line(words, said, run, tmp_path, capsys):
    places = {name: tmp_path / name for name in ("none", "empty", "logless", "blind", "file")} | {"run": run}
    for name in ("empty", "logless", "blind"):
        places[name].mkdir()
    places["file"].touch()
    for name, needed in (("logless", ()), ("blind", ("bus.log",))):
        for file in ("scenario.toml", "vehicle.toml", *needed):
            (places[name] / file).write_bytes((run / file).read_bytes())
    assert main([word.format(**places) for word in words]) == 2
    shown = capsys.readouterr().err
    assert said in shown and len(shown.splitlines()) == 1


def test_a_signal_without_a_code_is_named(run, capsys, monkeypatch):
    monkeypatch.setattr("gnss_hil.tools.export.codes.signals.by_value", lambda value: None)
    assert main(["export", "rinex", str(run)]) == 2
    assert "signal 0 of system gps has no RINEX code" in capsys.readouterr().err


def test_receivers_of_their_own_clocks(tmp_path, capsys):
    folder = played(tmp_path / "clocks", "--vehicle", "soyuz-ms-4clocks")
    capsys.readouterr()
    assert main(["export", "rinex", str(folder), "--no-navigation"]) == 0
    assert sorted(path.name for path in (folder / "export").iterdir()) == [
        f"soyuz_{name}.obs" for name in ("aft", "fore", "port", "starboard")
    ]
    assert "several clocks" in capsys.readouterr().err
