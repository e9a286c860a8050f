"""Whole runs with a terminal: what a person sees, and that the terminal is left as it was."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import pytest

from tests.support.runs import children_of, recorded
from tests.support.terminals import Session, row

FIT = " soyuz  00:"


def run(folder: Path, *more: str, columns: int = 80, lines: int = 24, duration: str = "1d") -> Session:
    words = ("run", "--duration", duration, "--pace", "x20", "--out", str(folder), *more)
    return Session(*words, columns=columns, lines=lines)


def left_clean(session: Session) -> None:
    assert not session.screen.alternate and session.screen.cursor_shown
    assert session.raw.count(b"\x1b[?1049h") == session.raw.count(b"\x1b[?1049l") == 1
    assert session.raw.rindex(b"\x1b[?7h") > session.raw.rindex(b"\x1b[?7l")  # wraps again


def drawn(session: Session):
    return lambda: row(session, FIT) and row(session, "fix").count("tracked")


@pytest.mark.slow
@pytest.mark.verifies(
    "tools/live/layout.py",
    "tools/live/screen.py",
    "tools/live/terminal.py",
    "tools/live/view.py",
    "tools/live/progress.py",
    "tools/common/durations.py",
    what="Live view on a terminal",
    by="pyte, a terminal in Python, sees it drawn, resized, left clean",
    status="validated",
)
def test_a_run_on_a_terminal_is_shown_resized_and_leaves_it_clean(tmp_path):
    session = run(tmp_path / "run", duration="90")
    session.watch(drawn(session))
    assert session.screen.alternate and not session.screen.cursor_shown
    assert "fore" in session.text and "port" in session.text
    session.resize(160, 50)
    session.watch(lambda: any(line.count("RX") == 4 for line in session.screen.display))
    session.watch(lambda: row(session, "error, 3-D [m]") and "█" in session.text)
    session.resize(60, 15)
    session.watch(lambda: row(session, "sat").count("C/N0") == 4)
    session.watch(lambda: "█" not in session.text)  # nothing of the large window is left
    session.watch(lambda: "error" in row(session, "fix"))
    assert session.end() == 0
    left_clean(session)
    after = session.raw[session.raw.rindex(b"\x1b[?1049l") :]
    assert b"run folder" in after and b"position error" in after
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["frames"]["lost"] == 0


def test_ctrl_c_leaves_the_terminal_clean(tmp_path):
    session = run(tmp_path / "run")
    session.watch(drawn(session))
    os.kill(session.process.pid, signal.SIGINT)
    assert session.end() == 130
    left_clean(session)
    assert b"(interrupted)" in session.raw[session.raw.rindex(b"\x1b[?1049l") :]


@pytest.mark.slow
def test_the_death_of_a_child_leaves_the_terminal_clean_and_is_told_after_it(tmp_path):
    session = run(tmp_path / "run")
    session.watch(drawn(session))
    os.kill(children_of(session.process.pid)["flightsw"], signal.SIGKILL)
    assert session.end() == 1
    left_clean(session)
    assert b"killed by SIGKILL" in session.raw[session.raw.rindex(b"\x1b[?1049l") :]


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["--plain", "--quiet"])
def test_plain_and_quiet_draw_nothing(tmp_path, asked):
    session = run(tmp_path / "run", asked, "--bus", "inline", "--pace", "lockstep", duration="300")
    assert session.end() == 0
    assert b"\x1b[" not in session.raw
    assert (b"% " in session.raw.partition(b"scenario")[0]) == (asked == "--plain")


@pytest.mark.slow
def test_a_held_terminal_does_not_hold_the_run(tmp_path):
    """Ctrl-S: the run goes on, for many more drawings than a terminal takes; Ctrl-Q shows where it stands."""
    session = run(tmp_path / "run")
    session.watch(drawn(session))
    session.type(b"\x13")
    log = tmp_path / "run" / "bus.log"
    recorded(log, log.stat().st_size + 500_000, session.process)
    session.type(b"\x11")
    shown = row(session, FIT)
    session.watch(lambda: row(session, FIT) not in ("", shown))
    os.kill(session.process.pid, signal.SIGINT)
    assert session.end() == 130
    left_clean(session)
