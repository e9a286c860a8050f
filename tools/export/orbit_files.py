"""Orbits of a run's craft as files: OEM, one a craft, or one SP3 file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.export import oem, sp3, time_series
from gnss_hil.tools.export.rinex import File
from gnss_hil.tools.export.run_data import CraftData


def files_of(kind: str, folder: Path, scenario: str, craft: Sequence[CraftData], true: bool) -> list[File]:
    """The files of kind "oem" or "sp3" of a run folder.

    true   where the craft really were, instead of their fixes
    """
    series = time_series.of_truth(folder, craft) if true else time_series.of_fixes(craft)
    if kind == "sp3":
        orbits = sp3.of_craft(series)
        return [File(f"{scenario}.sp3", sp3.text_of(orbits), so_many(len(orbits.t_ns), "epoch"))]
    return [File(f"{c.name}.oem", oem.text_of(c), f"{len(c.t_ns)} states") for c in series]
