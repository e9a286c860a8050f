"""A short run without errors, played once."""

from __future__ import annotations

from pathlib import Path

from gnss_hil.tools.command_line.main import main


def played(folder: Path, *more: str) -> Path:
    """A run folder of the first minute and a half of `soyuz`."""
    words = ["run", "soyuz", "--bus", "inline", "--duration", "90", "--out", str(folder), "--quiet", *more]
    assert main(words) == 0
    return folder
