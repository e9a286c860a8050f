"""The drawing of the chain: bars in proportion, every count told, nothing that is there vanishes."""

from __future__ import annotations

import re
from itertools import pairwise
from xml.etree import ElementTree

import pytest

from gnss_hil.tools.report.fault_chain import drawing
from gnss_hil.tools.results.fault_chain import Stage

pytestmark = pytest.mark.verifies(
    "tools/report/fault_chain.py",
    what="Faults in the report: the chain from frame to fix",
    by="geometry and words of the drawing, read back as XML",
    status="validated",
)

SVG = "{http://www.w3.org/2000/svg}"
STAGES = [
    Stage("frames touched", 1000, "came", {"did not come": 250}),
    Stage(
        "frames at the checks", 750, "let through", {"CORRUPTED": 700, "WRONG_SEQUENCE": 30, "A": 10, "B": 9}
    ),
    Stage("measurements", 500, "in a fix", {}),
    Stage("epochs", 20_000, "with a fix", {"NO_TIME_MARK": 1}),
]


def bars(stages) -> list[tuple[float, float]]:
    """Widths of what goes on and of what ends, stage by stage."""
    root = ElementTree.fromstring(drawing(stages))
    width = [float(one.get("width")) for one in root.iter(f"{SVG}rect")]
    return list(zip(width[::2], width[1::2], strict=True))


def words(stages) -> list[str]:
    return [one.text for one in ElementTree.fromstring(drawing(stages)).iter(f"{SVG}text")]


def test_bars_are_in_proportion_and_what_is_there_is_seen():
    found = bars(STAGES)
    assert all(sum(pair) == pytest.approx(344) for pair in found)
    assert found[0] == pytest.approx((258, 86)) and found[2] == pytest.approx((344, 0))
    assert found[1][0] == pytest.approx(2), "one in 750 is half a pixel, and drawn as two"
    assert found[3][1] == pytest.approx(2)


def test_every_count_is_told():
    assert words(STAGES) == [
        "frames touched", "1 000", "750 came", "250 did not come",
        "frames at the checks", "750", "1 let through", "700 corrupted", "30 wrong sequence", "19 otherwise",
        "measurements", "500", "500 in a fix",
        "epochs", "20 000", "19 999 with a fix", "1 no time mark",
    ]  # fmt: skip


def test_rare_reasons_are_told_together():
    ended = {"CORRUPTED": 9, "REPEATED": 8, "LOST": 2, "MARK": 1}
    assert words([Stage("frames", 20, "came", ended)])[2:] == ["9 corrupted", "8 repeated", "3 otherwise"]


def test_of_nothing_there_is_an_empty_bar():
    (rect,) = ElementTree.fromstring(drawing([Stage("measurements", 0, "in a fix", {})])).iter(f"{SVG}rect")
    assert rect.get("fill") == "none"


def test_words_of_different_lines_do_not_overlap():
    root = ElementTree.fromstring(drawing(STAGES))
    at = [(one.get("text-anchor"), float(one.get("y"))) for one in root.iter(f"{SVG}text")]
    for anchor in ("start", "end"):
        rows = [y for side, y in at if side == anchor]
        assert all(b - a >= 12 for a, b in pairwise(rows))
    height = float(root.get("viewBox").split()[3])
    assert max(y for _, y in at) <= height


def test_it_says_what_it_shows_to_who_does_not_see_it():
    (told,) = re.findall(r'aria-label="([^"]*)"', drawing(STAGES))
    assert told.startswith("From frame to fix: frames touched 1000, 750 came; ")
