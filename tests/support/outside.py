"""What tests need from outside: programs, kernels, measured data.

Where one is missing its tests skip, loudly; with GNSS_HIL_REQUIRE_ and its name in the environment, as in CI,
they fail.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import NoReturn

import pytest

from tests.support.programs import ROOT

DATA = Path(os.environ.get("GNSS_HIL_DATA", ROOT.parent / "shared" / "data"))
"""Real measurements and products. They are not shipped."""


def missing(what: str, reason: str) -> NoReturn:
    """Ends a test that cannot be done; `what`: SOCKETCAN, CHROMIUM, RTKLIB, DATA or VALGRIND."""
    (pytest.fail if os.environ.get(f"GNSS_HIL_REQUIRE_{what}") else pytest.skip)(reason)


def program(name: str, package: str, what: str) -> str:
    """Path of a program of a Debian package."""
    return shutil.which(name) or missing(what, f"{name} IS MISSING: install the Debian package {package}")


def data_file(name: str) -> Path:
    """A file of the real data."""
    path = DATA / name
    if not path.is_file():
        missing("DATA", f"REAL DATA MISSING: {path}; set GNSS_HIL_DATA to the folder that holds it")
    return path
