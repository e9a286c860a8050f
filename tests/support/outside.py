"""What tests need from outside: programs, packages, kernels, measured data.

Where one is missing its tests skip, loudly; with GNSS_HIL_REQUIRE_ and its name in the environment, as in CI,
they fail.
"""

from __future__ import annotations

import os
import shutil
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import pytest

from tests.support.programs import ROOT

NEEDS = {
    "SOCKETCAN": "a kernel with CAN, or user-mode Linux that has it",
    "CANUTILS": "programs of can-utils",
    "CHROMIUM": "a browser",
    "RTKLIB": "its programs",
    "DATA": "real measurements and products",
    "VALGRIND": "counted instructions",
    "CC": "a C compiler and what a Makefile calls",
    "PEERS": "Python packages of others that judge ours",
}
"""By the name behind GNSS_HIL_REQUIRE_."""

DATA = Path(os.environ.get("GNSS_HIL_DATA", ROOT.parent / "shared" / "data"))
"""Real measurements and products. They are not shipped."""


def missing(what: str, reason: str) -> NoReturn:
    """Ends a test, or a whole file of tests, that cannot be done; `what`: a name of NEEDS."""
    if what not in NEEDS:
        raise KeyError(what)
    if os.environ.get(f"GNSS_HIL_REQUIRE_{what}"):
        pytest.fail(reason)
    pytest.skip(reason, allow_module_level=True)


def program(name: str, package: str, what: str) -> str:
    """Path of a program of a Debian package."""
    return shutil.which(name) or missing(what, f"{name} IS MISSING: install the Debian package {package}")


def can_utils(*names: str) -> None:
    """These programs are there."""
    for name in names:
        program(name, "can-utils", "CANUTILS")


def c_tools(*names: str) -> None:
    """A compiler of this name and other programs that a Makefile calls are there."""
    for name in names:
        program(name, {"cc": "gcc", "sha256sum": "coreutils"}.get(name, name), "CC")


def peer(name: str) -> Any:
    """A package among the developers' that judges ours."""
    try:
        return import_module(name)
    except ImportError as error:
        missing("PEERS", f"PACKAGE {name} IS MISSING ({error}): install the developers' packages")


def data_file(name: str) -> Path:
    """A file of the real data."""
    path = DATA / name
    if not path.is_file():
        missing("DATA", f"REAL DATA MISSING: {path}; set GNSS_HIL_DATA to the folder that holds it")
    return path
