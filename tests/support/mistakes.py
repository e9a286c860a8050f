"""Mistakes as a table, and what is asked of each: its one line, its exit status, nothing left behind."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.tools.command_line.main import main


@dataclass(frozen=True)
class Mistake:
    """A command line, the one line it gets (regular expression), the exit status."""

    name: str
    argv: str
    line: str
    status: int


def table(text: str) -> list[Mistake]:
    """By exit status: what somebody does, the command with {names} of prepared files, the line it gets."""
    rows, status = [], 0
    lines = iter(text.strip().splitlines())
    for line in lines:
        if line.startswith("["):
            status = int(line[1])
        else:
            rows.append(Mistake(line, next(lines).strip().removeprefix("$ "), next(lines).strip(), status))
    return rows


def label(mistake: Mistake) -> str:
    return mistake.name.replace(" ", "-")


def argv_of(mistake: Mistake, folder: Path) -> list[str]:
    return [re.sub(r"\{(\w+)\}", lambda m: str(folder / m[1]), word) for word in mistake.argv.split()]


def gets_its_line_and_status(mistake: Mistake, bench: Path, desk: Path, capsys) -> None:
    before = {path: path.stat().st_mtime_ns for path in bench.rglob("*")}
    status = main(argv_of(mistake, bench))
    said = capsys.readouterr()
    lines = said.err.splitlines()
    assert status == mistake.status
    assert said.out == ""
    assert len(lines) == 1, said.err
    assert re.search(mistake.line, lines[0]), lines[0]
    assert list(desk.iterdir()) == []
    assert {path: path.stat().st_mtime_ns for path in bench.rglob("*")} == before
