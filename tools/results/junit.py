"""The verdict for CI systems: the run and each expectation as a JUnit test case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from gnss_hil.tools.results.text import missed

Case = tuple[str, str]
"""Name, and what is wrong; "" if nothing is."""


@dataclass(frozen=True, slots=True)
class Run:
    """What a verdict is of.

    name        of the scenario
    begun_utc   ISO 8601;  wall_s  from there to the verdict
    host        where it ran
    properties  what else there is to know, by name
    """

    name: str
    begun_utc: str
    wall_s: float
    host: str
    properties: Mapping[str, str]


def write(path: Path, run: Run, summary: Mapping[str, Any], failures: Sequence[str]) -> None:
    """JUnit XML of a run; `failures` are what broke it off, expectations apart."""
    rows = summary["expectations"]
    judged = [(row["name"], "; ".join(missed({"expectations": [row]}))) for row in rows]
    _write(path, run, [("run", "; ".join(failures)), *judged], "failure")


def write_error(path: Path, run: Run, text: str) -> None:
    """JUnit XML of a run that never came to a summary."""
    _write(path, run, [("run", text)], "error")


def _write(path: Path, run: Run, cases: Sequence[Case], kind: str) -> None:
    """kind: what it is called if the run itself is wrong, "failure" or "error"."""
    wrong = sum(bool(text) for _, text in cases)
    counts = {"tests": len(cases), "failures": 0, "errors": 0, "skipped": 0} | {f"{kind}s": wrong}
    suite = ElementTree.Element(
        "testsuite",
        {"name": f"gnss-hil {run.name}", **{name: str(count) for name, count in counts.items()}},
        time=f"{run.wall_s:.3f}", timestamp=run.begun_utc.removesuffix("Z"), hostname=run.host,
    )  # fmt: skip
    properties = ElementTree.SubElement(suite, "properties")
    for name, value in run.properties.items():
        ElementTree.SubElement(properties, "property", name=name, value=value)
    for number, (name, text) in enumerate(cases):
        seconds = run.wall_s if number == 0 else 0.0  # an expectation is looked up
        case = ElementTree.SubElement(suite, "testcase", classname=run.name, name=name, time=f"{seconds:.3f}")
        if text:
            ElementTree.SubElement(case, kind, message=text)
    path.write_bytes(ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True) + b"\n")
