"""VERIFICATION.md and docs/verification/PACKAGE.md."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

from tests.mutants.table import SCORES
from tests.verification.rows import STATUS, Row, rows

PACKAGES = {
    "dbc": "the contract on the bus, ways onto a bus, lockstep",
    "emulator": "truth: sky, craft, signals, receivers, sensors",
    "flightsw": "flight: measurements, navigation, integrity, assignment",
    "tools": "the person at the bench: runs, recordings, reports, exports",
}
FOLDER = "docs/verification"

INDEX = """# Verification

*Validated*: judged by a number or an implementation that is not ours, or by independent mathematics; the test
is named. *Modelled*: our choice; plausible, tested perhaps, not judged from outside. *Mutants*: small faults
put into the code one at a time (`make mutants`), and how many of them a test caught.

Written by `make docs` from the markers `verifies` on the tests; a test keeps it complete: every module has a
row, or a reason to have none. Tests of real data need `GNSS_HIL_DATA` or `../shared/data`; without, they skip
loudly.

| package | rows | validated | modelled | mutants caught |
|---|---:|---:|---:|---|
"""


def pages() -> dict[str, str]:
    """File -> text: the index, and a page for each package."""
    found, mutants = rows(), scores()
    texts = {f"{FOLDER}/{package}.md": _page(package, found, mutants) for package in PACKAGES}
    return {"VERIFICATION.md": _index(found, mutants), **texts}


def scores(path: Path = SCORES) -> dict[str, str]:
    """Package -> mutants caught, in words; empty if none were played."""
    if not path.exists():
        return {}
    table = tomllib.loads(path.read_text("utf-8"))
    return {package: f"{score['killed']} of {score['of']}" for package, score in table.items()}


def _of(package: str, found: Sequence[Row]) -> list[Row]:
    return [row for row in found if any(place.startswith(f"{package}/") for place in row.where)]


def _counts(found: Sequence[Row]) -> list[int]:
    return [sum(row.status == status for row in found) for status in STATUS]


def _index(found: Sequence[Row], mutants: dict[str, str]) -> str:
    lines = []
    for package, about in PACKAGES.items():
        own = _of(package, found)
        validated, modelled = _counts(own)
        link = f"[{package}]({FOLDER}/{package}.md): {about}"
        lines.append(f"| {link} | {len(own)} | {validated} | {modelled} | {mutants.get(package, '-')} |")
    validated, modelled = _counts(found)
    lines.append(f"| all (a row may be of two packages) | {len(found)} | {validated} | {modelled} | |")
    return INDEX + "\n".join(lines) + "\n"


def _page(package: str, found: Sequence[Row], mutants: dict[str, str]) -> str:
    own = _of(package, found)
    validated, modelled = _counts(own)
    folders: dict[str, list[Row]] = {}
    for row in sorted(own, key=lambda row: _first(package, row)):
        folders.setdefault(_first(package, row).rsplit("/", 1)[0], []).append(row)
    caught = f" Mutants caught: {mutants[package]}." if package in mutants else ""
    lines = [
        f"# Verification of {package}\n",
        f"{PACKAGES[package][:1].upper()}{PACKAGES[package][1:]}. {len(own)} rows: {validated} validated, "
        f"{modelled} modelled.{caught} What the words mean: [VERIFICATION.md](../../VERIFICATION.md).\n",
    ]
    for folder, inside in folders.items():
        lines += [
            f"## {folder}\n",
            "| what | where | status | judged by | test |",
            "|---|---|---|---|---|",
            *(_line(row, folder) for row in inside),
            "",
        ]
    return "\n".join(lines)


def _first(package: str, row: Row) -> str:
    """The first file of a row that is of the package."""
    return next(place for place in row.where if place.startswith(f"{package}/"))


def _line(row: Row, folder: str) -> str:
    where = ", ".join(f"`{place.removeprefix(f'{folder}/')}`" for place in row.where)
    tests = ", ".join(map(_link, row.tests))
    cells = (row.what, where, row.status, row.by, tests)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _link(test: str) -> str:
    file, _, function = test.partition("::")
    name = function.removeprefix("test_").replace("_", " ") or file.rsplit("/", 1)[1]
    return f"[{name}](../../{file})"
