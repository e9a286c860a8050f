"""What was run: files, settings, program."""

from __future__ import annotations

import hashlib
import subprocess
import tomllib
from pathlib import Path

import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.tools.recording import provenance
from gnss_hil.tools.recording.run_folder import RunFolder

pytestmark = pytest.mark.verifies(
    "tools/recording/provenance.py",
    what="Record of what was run",
    by="hashlib and git beside it; the documents of the scenarios that ship",
    status="validated",
)


def document(a: Path, b: Path) -> dict:
    return {
        "sky": {"gps": [str(a), str(b)], "glonass": "nominal"},
        "craft": [{"structure": "soyuz-ms", "attitude": {"file": str(a)}}],
    }


def test_files_are_hashed_copied_and_named_anew(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    a, b, folder = tmp_path / "x.nav", tmp_path / "elsewhere" / "x.nav", tmp_path / "run"
    a.write_text("one")
    b.write_text("two")
    folder.mkdir()
    changed = document(a, b)
    rows = provenance.take_inputs(changed, folder)
    assert [(row["file"], row["bytes"]) for row in rows] == [(str(a), 3), (str(b), 3)]
    assert [row["sha256"] for row in rows] == [hashlib.sha256(t).hexdigest() for t in (b"one", b"two")]
    assert [(folder / name).read_text() for name in changed["sky"]["gps"]] == ["one", "two"]
    assert changed["craft"][0]["attitude"]["file"] == changed["sky"]["gps"][0]
    assert changed["craft"][0]["structure"] == "soyuz-ms"


def test_a_large_file_is_named_and_not_copied(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "LARGEST_COPY_BYTES", 2)
    (tmp_path / "x.nav").write_text("one")
    changed = document(tmp_path / "x.nav", tmp_path / "x.nav")
    (row,) = provenance.take_inputs(changed, tmp_path)
    assert (row["copy"], row["sha256"]) == (None, hashlib.sha256(b"one").hexdigest())
    assert changed["sky"]["gps"][0] == str(tmp_path / "x.nav")


@pytest.mark.parametrize("name", scenarios.shipped())
def test_settings_are_what_the_file_has_other_than_the_defaults(name):
    path = scenarios.shipped()[name]
    raw = scenarios.read(path)
    settings = provenance.settings(scenarios.parse(raw, str(path)))
    assert not {"name", "description"} & set(settings)
    assert {key.split(".")[0] for key in settings} <= set(raw)
    assert settings["craft.0.vehicle"] == raw["craft"][0]["vehicle"]


def test_settings_say_factors_options_and_lists():
    raw = scenarios.read(scenarios.shipped()["soyuz"])
    raw["craft"][0] |= {"factors": {"code_noise": False, "cycle_slips": True}}
    raw["craft"][0]["flight"] = {"policy": "patent", "options": {"hysteresis_deg": 3}}
    raw["craft"][0]["orbit"]["forces"] = ["j2"]
    settings = provenance.settings(scenarios.parse(raw, "here"))
    assert settings["craft.0.factors.code_noise.enabled"] is False
    assert settings["craft.0.factors.cycle_slips"] == "on"
    assert settings["craft.0.flight.options.hysteresis_deg"] == 3
    assert settings["craft.0.orbit.forces"] == ["j2"]
    assert "craft.0.flight.policy" not in settings


def test_the_commit_is_gits_and_there_is_none_without_a_checkout(tmp_path):
    assert provenance._commit(tmp_path) is None
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(tmp_path)]
    for words in (["init", "-q"], ["commit", "-q", "--allow-empty", "-m", "x"]):
        subprocess.run([*git, *words], check=True)
    head = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout
    assert provenance._commit(tmp_path) == head[:12]
    (tmp_path / "new").touch()
    subprocess.run([*git, "add", "new"], check=True)
    assert provenance._commit(tmp_path) == f"{head[:12]}-dirty"
    (tmp_path / ".git").rename(tmp_path / "gone")
    (tmp_path / ".git").mkdir()  # damaged
    assert provenance._commit(tmp_path) is None


def test_a_moved_run_folder_is_enough_to_play_the_run(tmp_path):
    data = tmp_path / "data"
    data.mkdir()
    csv = data / "turn.csv"
    csv.write_text("nothing that is read here")
    raw = scenarios.read(scenarios.shipped()["soyuz"])
    raw["craft"][0]["attitude"] = {
        "mode": "table",
        "file": str(csv),
        "convention": "body_from_celestial",
    }
    folder = RunFolder(tmp_path / "run")
    folder.describe(scenarios.parse(raw, "here"), [vehicle.find("soyuz-ms").read_text()])
    moved = folder.path.rename(tmp_path / "moved")
    csv.unlink()
    named = tomllib.loads((moved / "scenario.toml").read_text())["craft"][0]["attitude"]["file"]
    assert (moved / named).read_text() == "nothing that is read here"
