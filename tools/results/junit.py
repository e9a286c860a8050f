"""The verdict for CI systems: the run and each expectation as a JUnit test case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from gnss_hil.tools.results.text import missed


def write(path: Path, summary: Mapping[str, Any], failures: Sequence[str]) -> None:
    """JUnit XML of a run; `failures` are what broke it off, expectations apart."""
    cases = [("run", "; ".join(failures))]
    cases += [(row["name"], "; ".join(missed({"expectations": [row]}))) for row in summary["expectations"]]
    suite = ElementTree.Element(
        "testsuite",
        name=f"gnss-hil {summary['scenario']}",
        tests=str(len(cases)),
        failures=str(sum(bool(text) for _, text in cases)),
    )
    for name, text in cases:
        case = ElementTree.SubElement(suite, "testcase", classname=summary["scenario"], name=name)
        if text:
            ElementTree.SubElement(case, "failure", message=text)
    path.write_bytes(ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True) + b"\n")
