"""Real measurements and products. They are not shipped: tests that need them skip where they are absent."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"

FOLDER = Path(os.environ.get("GNSS_HIL_DATA", _BESIDE))


def data_file(name: str) -> Path:
    """A file of the real data folder (GNSS_HIL_DATA, or ../shared/data); skips the test without it."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"REAL DATA MISSING: {path}; set GNSS_HIL_DATA to the folder that holds it")
    return path
