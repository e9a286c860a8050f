"""A run leaves its folder, or nothing at all if it ended before it began."""

from __future__ import annotations

import json
import signal
from dataclasses import replace

import pytest

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.processes import run_session
from gnss_hil.tools.run_config.config import OURS, Overrides, RunConfig

pytestmark = pytest.mark.verifies(
    "tools/processes/run_session.py", what="A run's folder, or nothing", by="rules of ours", status="modelled"
)


@pytest.fixture
def config(tmp_path) -> RunConfig:
    changes = Overrides(duration_s=3.0)
    return RunConfig(
        "soyuz", changes, "lockstep", "inline", OURS, OURS, tmp_path / "new" / "run", None,
        log=True, report=False, plain=True, quiet=True,
    )  # fmt: skip


def test_what_a_run_left_is_in_its_folder(config):
    ran = run_session.play(config)
    assert ran is not None
    assert ran.folder == config.out
    assert ran.outcome.epochs == ran.facts["epochs"] == 3
    assert list(ran.digests) == ["soyuz"]
    assert json.loads((ran.folder / "run.json").read_text()) == ran.facts
    assert json.loads((ran.folder / "summary.json").read_text()) == ran.summary
    assert (ran.folder / "bus.log").stat().st_size > 0


def test_interrupted_before_it_began_it_leaves_nothing(config, tmp_path):
    stop = run_session.Interruptible()
    stop._came = signal.SIGTERM
    assert run_session.play(config, stop) is None
    assert stop.status == 143
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("log", [True, False])
def test_broken_off_it_keeps_what_is_on_record(config, tmp_path, monkeypatch, capsys, log):
    """Only a run with frames on record has a folder to keep."""

    def fail(plan, recorder, *_):
        recorder.frames = int(log)
        raise KeyboardInterrupt

    monkeypatch.setattr("gnss_hil.tools.processes.inline.play", fail)
    with pytest.raises(KeyboardInterrupt):
        run_session.play(replace(config, log=log))
    assert (config.out in tmp_path.rglob("*")) == log
    assert ("run folder with everything" in capsys.readouterr().err) == log


def test_craft_that_have_a_bus_each_do_not_share_one(config):
    one_bus = replace(config, scenario="pair", overrides=Overrides(), bus="embedded:/nowhere/bus")
    with pytest.raises(Mistake, match="each of 2 craft has its own bus"):
        run_session.play(one_bus)
    assert not config.out.exists()


@pytest.mark.parametrize(
    ("seen", "said"),
    [
        (
            {"mean": 0.0, "min": 0, "max": 0},
            ["craft a: no satellite was in view in any epoch: are sky, orbit,"],
        ),
        ({"mean": 3.0, "min": 0, "max": 7}, ["craft a: there were epochs without a satellite in view"]),
        ({"mean": 6.0, "min": 5, "max": 7}, []),
        ({"mean": None, "min": None, "max": None}, []),
    ],
)
def test_an_empty_sky_is_told(seen, said):
    found = list(run_session._empty_skies({"craft": {"a": {"satellites_visible": seen}}}))
    assert len(found) == len(said)
    assert all(line.startswith(words) for line, words in zip(found, said, strict=True))
