"""Reporting a folder whose run.json suffered."""

from __future__ import annotations

import json
import shutil

import pytest

from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import FACTS, LOG, SCENARIO
from gnss_hil.tools.results import assemble

WHOLE = {
    "scenario": "soyuz", "seed": 1, "policy": "visible", "pace": "lockstep",
    "bus": {"interface": "embedded", "channel": ""}, "reproducible": True, "interrupted": False,
    "duration_s": 60, "epoch_interval_s": 1, "epochs": 60, "epochs_unanswered": 0, "real_time_factor": 100.0,
    "epoch_latency_ms": {"p50": 1.0, "p99": None}, "frames_sent": 1000,
    "expect": {"soyuz.fixes": {"min": 50}},
}  # fmt: skip
TEXT = json.dumps(WHOLE, indent=2)

DAMAGED = {
    "empty": b"",
    "cut": TEXT[: len(TEXT) // 2].encode(),
    "no-text": bytes(range(256)),
    "no-object": b"[1, 2]",
    "null": b"null",
    "empty-object": b"{}",
    "key-missing": json.dumps({k: v for k, v in WHOLE.items() if k != "epochs"}).encode(),
    "key-missing-inside": json.dumps({**WHOLE, "bus": {}}).encode(),
    "wrong-type": json.dumps({**WHOLE, "epoch_interval_s": "one"}).encode(),
    "no-interval": json.dumps({**WHOLE, "epoch_interval_s": 0}).encode(),
    "wrong-expectation": json.dumps({**WHOLE, "expect": {"soyuz.fixes": 3}}).encode(),
}


@pytest.mark.parametrize("damaged", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_run_json_is_told_in_one_line_that_names_it(tmp_path, damaged, capsys):
    shutil.copy(scenarios.shipped()["soyuz"], tmp_path / SCENARIO)
    (tmp_path / LOG).touch()
    (tmp_path / FACTS).write_bytes(damaged)
    assert main(["report", str(tmp_path)]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert str(tmp_path / FACTS) in said[0]
    assert "internal" not in said[0]


def test_the_line_says_what_is_wrong(tmp_path):
    (tmp_path / FACTS).write_bytes(DAMAGED["key-missing-inside"])
    with pytest.raises(Mistake, match=r"run\.json: .*bus\.interface"):
        assemble.read_facts(tmp_path)


def test_a_whole_run_json_is_read_as_it_is(tmp_path):
    assert assemble.read_facts(tmp_path) is None
    (tmp_path / FACTS).write_text(TEXT)
    assert assemble.read_facts(tmp_path) == WHOLE


def test_what_report_guesses_of_a_dead_run_can_be_read_again(tmp_path):
    path = scenarios.shipped()["soyuz"]
    guessed = assemble.facts_of(scenarios.parse(scenarios.read(path), str(path)), 0)
    (tmp_path / FACTS).write_text(json.dumps(guessed))
    assert assemble.read_facts(tmp_path) == guessed
