"""What an install brings: pins that meet the declared minima and name all there is, and licences."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import Distribution
from importlib.util import module_from_spec, spec_from_file_location

import pytest
from packaging.version import Version

from tests.support.programs import ROOT

SCRIPT = ROOT / "tools" / "packaging" / "constraints.py"


def loaded():
    spec = spec_from_file_location("constraints", SCRIPT)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


constraints = loaded()
RUNTIME = constraints.runtime()


def test_pins_meet_the_declared_minima():
    pins = constraints.pins()
    declared = constraints.declared()
    assert len(declared) > 10
    for requirement in declared:
        name = constraints.canonicalize_name(requirement.name)
        assert pins[name] in requirement.specifier, requirement


def asked_by_pinned() -> list[tuple[str, object]]:
    """Package and what it requires, of those that are installed as pinned: others may need other packages."""
    pins = constraints.pins()
    return [
        (name, further)
        for name, found in RUNTIME.items()
        if found.version == pins.get(name)
        for further in map(constraints.Requirement, found.requires or ())
        if further.marker is None or further.marker.evaluate({"extra": ""})
    ]


def test_every_package_that_is_needed_is_pinned_and_as_the_others_want_it():
    pins = constraints.pins()
    assert {"python-can", "numpy", "wrapt", "pydantic-core"} <= set(pins)  # direct and not
    for name, further in asked_by_pinned():
        assert pins[constraints.canonicalize_name(further.name)] in further.specifier, f"{name}: {further}"


def test_what_is_installed_is_as_new_as_declared():
    """So a suite that passes in an environment of the lowest versions speaks of these."""
    for requirement in constraints.declared():
        assert RUNTIME[constraints.canonicalize_name(requirement.name)].version in requirement.specifier


def test_the_lowest_versions_are_those_declared():
    said = subprocess.run([sys.executable, SCRIPT, "--lowest"], capture_output=True, text=True, check=True)
    lowest = dict(line.split("==") for line in said.stdout.splitlines())
    declared = constraints.declared(extras=True)
    assert {constraints.canonicalize_name(r.name) for r in declared} == set(lowest)
    for requirement in declared:
        assert lowest[requirement.name] in requirement.specifier
        lower = [s.version for s in requirement.specifier]
        assert lower == [lowest[requirement.name]]


def test_a_dependency_without_a_minimum_is_told(monkeypatch):
    monkeypatch.setattr(constraints, "declared", lambda extras: [constraints.Requirement("numpy<3")])
    with pytest.raises(ValueError, match="numpy<3"):
        constraints.lowest()


LISTED = dict(
    re.findall(r"^\| ([a-z][\w.-]*) \| (.+?) \|$", (ROOT / "docs/licences.md").read_text("utf-8"), re.M)
)
LISTED.pop("package", None)

WORDS = {
    "MIT": "MIT", "MIT License": "MIT", "BSD License": "BSD", "BSD": "BSD", "BSD 3-Clause License": "BSD",
    "Apache Software License": "Apache", "Python Software Foundation License": "PSF",
    "The Unlicense (Unlicense)": "Unlicense", "LGPL v3": "LGPL",
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL",
}  # fmt: skip
"""What packages without an SPDX expression say, and the family that it is of."""


def families(expression: str) -> set[str]:
    """'BSD-3-Clause AND MIT': {'BSD', 'MIT'}."""
    return {word.split("-")[0] for word in re.split(r" (?:AND|OR|WITH) |[()]", expression) if word}


def said(found: Distribution) -> set[str]:
    """Families of licences in a package's metadata."""
    expression = found.metadata["License-Expression"]
    if expression:
        return families(expression)
    classifiers = found.metadata.get_all("Classifier") or []
    words = {line.rpartition(" :: ")[2] for line in classifiers if line.startswith("License :: ")}
    words -= {"OSI Approved"}
    return {WORDS[word] for word in words or {found.metadata["License"]}}


def test_licences_of_all_that_is_needed_are_listed_and_no_others():
    assert set(LISTED) == set(constraints.pins())
    assert LISTED["python-can"] == "LGPL-3.0-only"


@pytest.mark.parametrize("name", sorted(set(RUNTIME) & set(constraints.pins())))
def test_a_licence_is_what_the_package_says(name):
    found, listed = RUNTIME[name], LISTED[name]
    assert said(found) & families(listed)
    if Version(found.version) == Version(constraints.pins()[name]):
        assert said(found) == families(listed)
        assert found.metadata["License-Expression"] in (None, listed)
