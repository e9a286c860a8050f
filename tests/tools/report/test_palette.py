"""The colours of antennas as people see them who see colours otherwise."""

from __future__ import annotations

import re
from importlib import resources
from itertools import combinations

import numpy as np
import pytest

pytestmark = pytest.mark.verifies(
    "tools/report/palette.css",
    what="Report: colours of antennas",
    by="colour blindness by Machado et al. (2009), differences in CIE L\\*a\\*b\\*; contrast of WCAG 2.2",
    status="validated",
)

CSS = (resources.files("gnss_hil.tools.report") / "palette.css").read_text("utf-8")
LIGHT, DARK = (
    dict(re.findall(r"(--[\w-]+): (#[0-9a-f]{6})", part)) for part in CSS.split("@media screen")[:2]
)

SIGHT = {
    "usual": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900],
    ],
}  # fmt: skip
"""Linear RGB as seen. Source: Machado, Oliveira, Fernandes, IEEE TVCG 15 (2009), table of severity 1.0."""

XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""From linear sRGB. Source: IEC 61966-2-1, D65."""


def linear(colour: str) -> np.ndarray:
    c = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(c > 0.04045, ((c + 0.055) / 1.055) ** 2.4, c / 12.92)


def lab(colour: str, sight) -> np.ndarray:
    """CIE L*a*b* of a colour. Source: CIE 15, 8.2.1"""
    x = XYZ @ np.clip(np.array(sight) @ linear(colour), 0, 1) / XYZ.sum(axis=1)
    f = np.where(x > 0.008856, np.cbrt(x), 7.787 * x + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def apart(colours, sight) -> float:
    """Least difference of any two; 2.3 can just be noticed side by side."""
    return min(np.linalg.norm(lab(a, sight) - lab(b, sight)) for a, b in combinations(colours, 2))


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize("sight", SIGHT.values(), ids=SIGHT)
def test_antennas_stay_apart_from_each_other_and_from_the_greys(theme, sight):
    antennas = [theme[f"--antenna-{i}"] for i in range(1, 9)]
    assert apart(antennas[:4], sight) > 25
    assert apart(antennas, sight) > 20
    for grey in (theme["--idle"], theme["--other"]):
        assert min(apart([grey, colour], sight) for colour in antennas) > 14


def contrast(theme, name: str, paper: str) -> float:
    """Of WCAG 2.2, "contrast ratio"."""
    low, high = sorted(float(XYZ[1] @ linear(theme[colour])) for colour in (name, paper))
    return (high + 0.05) / (low + 0.05)


LINES = (*(f"--antenna-{i}" for i in range(1, 9)), "--accent", "--second", "--muted", "--other")


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize("name", LINES)
def test_lines_and_bars_can_be_seen_on_the_paper(theme, name):
    """WCAG 2.2, 1.4.11 (AA): 3 to 1."""
    assert contrast(theme, name, "--paper") >= 3


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize("paper", ["--paper", "--ground"])
@pytest.mark.parametrize("name", ["--ink", "--soft", "--good", "--bad"])
def test_words_can_be_read(theme, paper, name):
    """WCAG 2.2, 1.4.3 (AA): 4.5 to 1."""
    assert contrast(theme, name, paper) >= 4.5


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_words_can_be_read_where_there_was_no_fix(theme):
    """A shade lies behind ticks and lines."""
    assert contrast(theme, "--ink", "--idle") >= 4.5
    assert contrast(theme, "--accent", "--idle") >= 3
