"""Are a folder's files those of its run? Swapped, cut and missing ones are told, by whoever reads them."""

from __future__ import annotations

import hashlib
import json
import shutil

import pytest

import gnss_hil
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.recording import fingerprints
from gnss_hil.tools.recording.run_folder import FACTS, LOG, SUMMARY, TRUTH

pytestmark = pytest.mark.verifies(
    "tools/recording/fingerprints.py",
    what="Files of a run folder that are of another run, cut or missing",
    by="hashlib; runs whose files were swapped, cut and removed before they were reported and replayed",
    status="validated",
)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two that differ in their seeds alone."""
    folders = [tmp_path_factory.mktemp("runs") / name for name in ("one", "two")]
    for seed, folder in enumerate(folders, 1):
        words = ["run", "soyuz", "--bus", "inline", "--duration", "50", "--seed", str(seed), "--quiet"]
        assert main([*words, "--no-report", "--out", str(folder)]) == 0
    return folders


@pytest.fixture
def run(runs, tmp_path):
    return shutil.copytree(runs[0], tmp_path / "run")


def test_every_file_of_the_record_has_its_sum(run):
    record = json.loads((run / FACTS).read_bytes())["record"]
    assert record.keys() == {LOG, TRUTH, "scenario.toml", "vehicle.toml"}
    for name, said in record.items():
        octets = (run / name).read_bytes()
        assert said == {"bytes": len(octets), "sha256": hashlib.sha256(octets).hexdigest()}
    assert "record" not in json.loads((run / SUMMARY).read_bytes())


def test_what_is_as_it_was_is_not_spoken_of(run, capsys):
    assert main(["report", str(run)]) == 0
    assert main(["replay", str(run), "--only", "emulator", "--quiet"]) == 0
    assert capsys.readouterr().err == ""
    assert gnss_hil.Run.read(run).notes == ()


def hurt(run, other, how):
    """The line that must be said."""
    if how == "of another run":
        shutil.copy(other / LOG, run / LOG)
        size, of = ((folder / LOG).stat().st_size for folder in (other, run))
        assert size > 1000 and of > 1000
        return f"{LOG} is not as the run left it: "
    if how == "cut":
        whole = (run / LOG).read_bytes()
        (run / LOG).write_bytes(whole[: len(whole) // 2])
        return f"{LOG} is not as the run left it: {len(whole) // 2} bytes of {len(whole)}"
    if how == "another truth":
        shutil.copy(other / TRUTH, run / TRUTH)
        return f"{TRUTH} is not as the run left it: another SHA-256"
    (run / TRUTH).unlink()
    return f"{TRUTH} of the run is missing"


@pytest.mark.parametrize("how", ["of another run", "cut", "another truth", "no truth"])
def test_what_is_not_is_told(run, runs, how, capsys):
    line = hurt(run, runs[1], how)
    assert main(["report", str(run)]) == 0
    assert f"gnss-hil: note: {line}" in capsys.readouterr().err
    assert [one.startswith(line) for one in json.loads((run / SUMMARY).read_bytes())["remarks"]] == [True]
    assert line in (run / "report.html").read_text()
    assert [one.startswith(line) for one in gnss_hil.Run.read(run).notes] == [True]
    main(["replay", str(run), "--only", "emulator", "--quiet"])
    assert f"gnss-hil: {run}: {line}" in capsys.readouterr().err

    if (run / TRUTH).is_file():
        assert main(["export", "oem", str(run), "--out", str(run / "export")]) == 0
        assert f"gnss-hil: {run}: {line}" in capsys.readouterr().err
    for name in (LOG, TRUTH):  # put right, nothing of it stays
        shutil.copy(runs[0] / name, run / name)
    assert main(["report", str(run)]) == 0
    assert json.loads((run / SUMMARY).read_bytes())["remarks"] == []


def test_a_replay_has_sums_of_its_own(run, tmp_path, capsys):
    out = tmp_path / "again"
    assert main(["replay", str(run), "--only", "emulator", "--quiet", "--report", str(out)]) == 0
    assert [*fingerprints.changed(out, json.loads((out / FACTS).read_bytes())["record"])] == []
    shutil.copy(run / "vehicle.toml", out / "vehicle.toml")
    (out / "vehicle.toml").write_text((out / "vehicle.toml").read_text() + "\n")
    assert main(["report", str(out)]) == 0
    assert "vehicle.toml is not as the run left it" in capsys.readouterr().err
