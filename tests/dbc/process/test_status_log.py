"""What a process tells of itself to the one that started it."""

from __future__ import annotations

import json
import os

import pytest

from gnss_hil.dbc.process.status_log import STATUS_S, StatusLog

pytestmark = pytest.mark.verifies(
    "dbc/process/status_log.py",
    what="What a process tells of itself",
    by="lines that are read back",
    status="modelled",
)


def test_a_line_of_json_for_each_event_at_once(tmp_path):
    with StatusLog(str(tmp_path / "status")) as status:
        status.tell("begun", epochs=7)
        status.tell("ended", fixes=3)
        lines = (tmp_path / "status").read_text().splitlines()
    assert [json.loads(line) for line in lines] == [
        {"event": "begun", "epochs": 7},
        {"event": "ended", "fixes": 3},
    ]


def test_a_descriptor_will_do_and_so_will_nobody():
    reading, writing = os.pipe()
    with StatusLog(f"fd:{writing}") as status, StatusLog(None) as nowhere:
        status.tell("begun")
        nowhere.tell("begun")
    assert json.loads(os.read(reading, 100)) == {"event": "begun"}
    os.close(reading)


def test_progress_is_due_now_and_then():
    with StatusLog(None) as status:
        assert [status.due(t) for t in (1.0, 1.0 + STATUS_S / 2, 1.0 + STATUS_S)] == [True, False, True]
