"""The verdict for CI systems: the run, each expectation and each fault of which something was expected, as a
JUnit test case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from gnss_hil.tools.results.fault_text import fault_missed
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
    _write(path, suite(run, summary, failures))


def write_error(path: Path, run: Run, text: str) -> None:
    """JUnit XML of a run that never came to a summary."""
    _write(path, error_suite(run, text))


def error_suite(run: Run, text: str) -> ElementTree.Element:
    """The verdict of a run that never came to a summary."""
    return _suite(run, [("run", text)], "error")


def write_all(path: Path, suites: Sequence[ElementTree.Element]) -> None:
    """JUnit XML of several runs."""
    whole = ElementTree.Element("testsuites")
    whole.extend(suites)
    _write(path, whole)


def suite(run: Run, summary: Mapping[str, Any], failures: Sequence[str]) -> ElementTree.Element:
    """The verdict of one run."""
    rows = summary["expectations"]
    judged = [(row["name"], "; ".join(missed({"expectations": [row]}))) for row in rows]
    faults = [
        (f"fault {row['craft']} {row['fault']}", "; ".join(fault_missed(row)))
        for row in summary.get("faults", ())
        if row["expectations"]
    ]
    return _suite(run, [("run", "; ".join(failures)), *judged, *faults], "failure")


def _write(path: Path, root: ElementTree.Element) -> None:
    path.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _suite(run: Run, cases: Sequence[Case], kind: str) -> ElementTree.Element:
    """kind: what it is called if the run itself is wrong, "failure" or "error"."""
    wrong = sum(bool(text) for _, text in cases)
    counts = {"tests": len(cases), "failures": 0, "errors": 0, "skipped": 0} | {f"{kind}s": wrong}
    found = ElementTree.Element(
        "testsuite",
        {"name": f"gnss-hil {run.name}", **{name: str(count) for name, count in counts.items()}},
        time=f"{run.wall_s:.3f}", timestamp=run.begun_utc.removesuffix("Z"), hostname=run.host,
    )  # fmt: skip
    properties = ElementTree.SubElement(found, "properties")
    for name, value in run.properties.items():
        ElementTree.SubElement(properties, "property", name=name, value=value)
    for number, (name, text) in enumerate(cases):
        seconds = run.wall_s if number == 0 else 0.0  # an expectation is looked up
        case = ElementTree.SubElement(found, "testcase", classname=run.name, name=name, time=f"{seconds:.3f}")
        if text:
            ElementTree.SubElement(case, kind, message=text)
    return found
