"""Runs with a page, and the page in a browser."""

from __future__ import annotations

import re
from pathlib import Path

from gnss_hil.tools.command_line.main import main
from tests.support import browser

TITLES = (
    "Assignment", "Sky of antenna fore", "Sky of antenna starboard", "Sky of antenna aft",
    "Sky of antenna port", "Position error", "Velocity error", "Normalised squared error", "Receiver clock",
    "Attitude", "Residuals", "Satellites by antenna", "Satellites", "Dilution of precision", "Ground track",
    "Orbit", "Carrier to noise density", "Bus load", "Latency of an epoch", "Commands and faults",
)  # fmt: skip

SKIES = TITLES[1:5]


def played(folder: Path, *more: str) -> Path:
    """A short run of the craft that the pages of these tests are of."""
    assert (
        main(["run", "soyuz", "--bus", "inline", "--duration", "90", "--quiet", "--out", str(folder), *more])
        == 0
    )
    return folder


def drawn(page: Path, folder: Path, **how) -> dict:
    """A page that was drawn whole, without a word of complaint and without asking anybody for anything."""
    browser.require()
    seen = browser.look(page, folder, **how)
    assert seen.complaints == []
    assert seen.probe is not None, "the page never finished drawing"
    for plot in seen.probe["plots"]:
        assert plot["surfaces"] and plot["traces"], plot
    assert not [address for address in seen.probe["addresses"] + seen.probe["fetched"] if "//" in address]
    return seen.probe


def titles(page: Path) -> list[str]:
    return re.findall(r"<figcaption><h3>([^<]*)</h3>", page.read_text("utf-8"))
