"""docs/results.md, from the table and what is kept; and the headlines of the README."""

from __future__ import annotations

from collections.abc import Mapping

from tests.results.kept import ROOT, Kept, read
from tests.results.table import RESULTS, SECTIONS, Result, Section

NONE = "not measured yet"

LEAD = """# Results

Written by `make results` (`QUICK=1` for those of minutes) from the table in `tests/results/table.py` and the
figures it measured; do not edit. Each row says when and of which commit it was measured; a + behind the
commit means that files were changed since, a load that other work took processors. Commands are run in the
repository, with `GNSS_HIL_DATA` set to the folder of real data (rows that need none do without). `RUN` is a
folder; a run that names none gets one.
"""

EXAMPLE = "embedded"
"""The result whose output the README shows: that of `make run`."""


def page(kept: Mapping[str, Kept] | None = None) -> str:
    """The page, Markdown."""
    kept = read() if kept is None else kept
    machines = sorted({row.machine for name, row in kept.items() if name in RESULTS})
    measured = "\n".join(["Measured on:\n", *(f"- {machine}" for machine in machines)])
    return "\n".join([LEAD, measured + "\n", *(_section(section, kept) for section in SECTIONS)])


def _section(section: Section, kept: Mapping[str, Kept]) -> str:
    numeric = ["---:"] * (len(section.heads) - 1) if len(section.heads) > 2 else ["---"]
    lines = [
        f"## {section.title}\n",
        section.about + "\n",
        _line(*section.heads, "measured"),
        _line("---", *numeric, "---"),
        *(_line(result.what, *cells(result, kept), when(result, kept)) for result in section.results),
        "",
        *(f"    {line}" for result in section.results for line in result.command.splitlines()),
        "",
    ]
    return "\n".join(lines)


def _line(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


class Figure(float):
    """A number that also knows the format `length`: metres in the unit people would use, three digits."""

    def __format__(self, spec: str) -> str:
        if spec != "length":
            return super().__format__(spec)
        _, unit, size = next((row for row in LENGTHS if abs(self) >= row[0]), LENGTHS[-1])
        return f"{self / size:.3g} {unit}"


LENGTHS = ((0.1, "m", 1.0), (1e-3, "mm", 1e-3), (0.0, "um", 1e-6))
"""The least length [m] that is given in a unit, the unit, its size [m]."""


def _readable(figures: Mapping[str, float]) -> dict[str, Figure]:
    return {name: Figure(value) for name, value in figures.items()}


def cells(result: Result, kept: Mapping[str, Kept]) -> list[str]:
    """A result's figures in its formats."""
    if result.name not in kept:
        return [NONE] + [""] * (len(result.cells) - 1)
    return [cell.format(**_readable(kept[result.name].figures)) for cell in result.cells]


def when(result: Result, kept: Mapping[str, Kept]) -> str:
    """Date and commit; and whether the command has changed since."""
    row = kept.get(result.name)
    if row is None:
        return ""
    busy = f", load {row.load:.0f}" if row.load > 1 else ""
    other = "" if row.command == result.command else ", by another command"
    return f"{row.date}, {row.commit}{busy}{other}"


def headlines(kept: Mapping[str, Kept] | None = None) -> str:
    """The README's five figures."""
    kept = read() if kept is None else kept
    figures = {name: _readable(row.figures) | {"conditions": conditions(row)} for name, row in kept.items()}
    return "\n".join(f"- {line}" for line in (line(figures) for line in HEADLINES) if line)


def conditions(row: Kept) -> str:
    """On what machine a speed was measured, and what else that did."""
    return f"{row.machine.split(',')[0]}, {f'load {row.load:.0f}' if row.load > 1 else 'idle'}"


def _headline(text: str, *names: str):
    """A line of figures, `{name[figure]}`; nothing while one of them is missing."""

    def line(figures: Mapping[str, Mapping[str, float | str]]) -> str:
        known = {name.replace("-", "_"): figures[name] for name in names if name in figures}
        return text.format(**known) if len(known) == len(names) else ""

    return line


HEADLINES = (
    _headline(
        "A day of a real sky: **{day_patent[satellites]:.1f}** distinct satellites by the patent's method, "
        "{day_elevation[satellites]:.1f} by receivers that take the highest first; PDOP "
        "**{day_patent[pdop]:.2f}** against {day_elevation[pdop]:.2f}, error **{day_patent[median_m]:.2f} "
        "m** against {day_elevation[median_m]:.2f} m.",
        "day-patent", "day-elevation",
    ),
    _headline("Without noise, emulator and flight software agree to **{quiet[rms_m]:length}** RMS.", "quiet"),
    _headline(
        "A real receiver (GRACE-B, a day) played onto the bus: **{grace[median_m]:.2f} m** from its "
        "published orbit.",
        "grace",
    ),
    _headline(
        "Ten minutes of 24 channels, emulator, flight software and the record of every frame: "
        "**{embedded[times]:,.0f} times** as fast as real time ({embedded[conditions]}).",
        "embedded",
    ),
    _headline("Same scenario and seed, same bytes on every bus, late, paused or hogged.", "reproducible"),
)  # fmt: skip


def example(kept: Mapping[str, Kept] | None = None) -> str:
    """What `make run` prints, indented; empty if it was not measured."""
    kept = read() if kept is None else kept
    row = kept.get(EXAMPLE)
    return "\n".join(f"    {line}".rstrip() for line in row.output.strip().splitlines()) if row else ""


def readme(kept: Mapping[str, Kept] | None = None) -> str:
    """README.md with what is measured between its marks."""
    text = (ROOT / "README.md").read_text("utf-8")
    for name, inside in (("make run", example(kept)), ("headlines", headlines(kept))):
        start, end = f"<!-- {name}: written by make docs -->\n", f"\n<!-- end of {name} -->"
        head, rest = text.split(start)
        text = head + start + inside + end + rest.split(end)[1]
    return text
