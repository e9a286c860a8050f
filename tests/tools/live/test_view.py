"""The live view from real epochs: what it counts, what it shows, that it fits every window."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.decoder.block import of_frames
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.decoder.epoch_snapshot import snapshot
from gnss_hil.tools.decoder.latest import Latest
from gnss_hil.tools.live import display
from gnss_hil.tools.live.layout import screen
from gnss_hil.tools.live.live_error import LiveError
from gnss_hil.tools.live.progress import Progress
from gnss_hil.tools.live.screen import plain
from gnss_hil.tools.live.summary import CraftSummary, RunSummary
from gnss_hil.tools.live.view import LiveView
from tests.support.live_runs import EPOCHS, epochs, soyuz, write_truth

pytestmark = pytest.mark.verifies(
    "tools/decoder/counters.py",
    "tools/decoder/screen.py",
    "tools/live/live_error.py",
    "tools/live/summary.py",
    what="Live view: counts, ages, error",
    by=(
        "the recorder's digest on damaged frames, loops over frames one by one: readers of ours against each "
        "other"
    ),
    status="modelled",
)

PLAN = soyuz()
(CODEC,), (VEHICLE,) = PLAN.codecs, PLAN.vehicles


class Window:
    """A terminal in memory."""

    def __init__(self, columns: int, lines: int, ready: bool = True):
        self.size, self.ready = (columns, lines), ready
        self.drawn: list[list[str]] = []
        self.written: list[str] = []

    def draw(self, lines):
        self.drawn.append([plain(spans) for spans in lines])

    def say(self, text):
        self.written.append(text)

    def leave(self):
        pass


def viewed(tmp_path, window: Window, blocks=None, truth_rows: int = EPOCHS) -> LiveView:
    """A view that has heard all epochs and drawn once."""
    frames, rows = epochs()
    view = LiveView(PLAN, write_truth(tmp_path / "truth", rows[:truth_rows]), window)
    for epoch, block in enumerate(blocks or frames):
        view.hear(0, epoch, block)
    view.refresh(unanswered=2)
    return view


def digested():
    digest = Digest(CODEC)
    for block in epochs()[0]:
        digest.feed(block)
    digest.finish()
    return digest


@pytest.mark.parametrize(
    ("columns", "lines"), [(80, 24), (60, 15), (200, 50), (40, 10), (20, 5), (7, 3), (1, 1)]
)
def test_a_screen_fits_its_window(tmp_path, columns, lines):
    window = Window(columns, lines)
    viewed(tmp_path, window)
    (drawn,) = window.drawn
    assert 0 < len(drawn) <= lines
    assert max(map(len, drawn)) <= columns


def test_an_ordinary_window_shows_every_channel_and_the_fix(tmp_path):
    window = Window(80, 24)
    viewed(tmp_path, window)
    (drawn,) = window.drawn
    text = "\n".join(drawn)
    fixes = digested().fixes
    assert f"PDOP {fixes['pdop'][-1]:.2f}" in text
    assert f"in fix {int(fixes['satellites'][-1])}" in text
    assert "unanswered 2" in text and "lost 0  rejected 0" in text and f"epoch {EPOCHS - 1}" in text
    assert "GPS 2012-10-31T00:16:14" in text
    for name in VEHICLE.names:
        assert re.search(rf"\b{name}  \d/6", text)
    rows = re.findall(r" ([0-5]) ([GR]\d\d) +(\w+) ", text)
    assert len(rows) == 24 and {state for _, _, state in rows} <= {"FULL", "ASKED"}


def test_a_wide_window_has_the_antennas_side_by_side(tmp_path):
    window = Window(200, 50)
    viewed(tmp_path, window)
    (drawn,) = window.drawn
    (heads,) = [text for text in drawn if "fore" in text]
    assert all(name in heads for name in VEHICLE.names)


def test_of_a_fix_without_lists_no_channel_is_said_to_be_left_out(tmp_path):
    """Without NAV_USED nobody says which channels are in the fix: neither "yes" nor "-"."""
    unlisted = [block[block.can_id != CODEC.can_id_of["NAV_USED", 0]] for block in epochs()[0]]
    columns = []
    for blocks in (None, unlisted):
        window = Window(200, 50)
        viewed(tmp_path, window, blocks)
        cells = [re.findall(r" [0-5] [GR]\d\d +FULL +\S+ +\S+ +\S+ +(\S+)", text) for text in window.drawn[0]]
        columns.append([cell for row in cells for cell in row])
    listed, told = columns
    assert "yes" in listed and "?" not in listed
    assert set(told) == {"?"} and len(told) == len(listed)


def test_a_large_window_has_charts_and_units_and_a_small_one_has_none(tmp_path):
    large, usual = Window(160, 50), Window(80, 24)
    viewed(tmp_path, large)
    viewed(tmp_path, usual)
    text = "\n".join(large.drawn[0])
    assert "error, 3-D [m]" in text and "satellites in the fix" in text
    assert text.count("dBHz") == len(VEHICLE.names) and " deg" in text
    assert "error, 3-D [m]" not in "\n".join(usual.drawn[0])
    assert re.search(r"█.*█", text) and len(large.drawn[0]) <= 50


def test_a_small_window_says_what_it_leaves_out(tmp_path):
    window = Window(38, 11)
    viewed(tmp_path, window)
    (drawn,) = window.drawn
    shown = sum(len(re.findall(r"\b[GR]\d\d\b", text)) for text in drawn)
    more = sum(int(n) for text in drawn for n in re.findall(r"\+(\d+)", text))
    assert more and shown + more == 24


def test_the_error_is_that_of_the_same_epoch(tmp_path):
    """The truth lags: the error is that of the last fix whose truth has come."""
    frames, rows = epochs()
    live_error = LiveError(write_truth(tmp_path / "truth", rows[:-3]), 0, 1)
    latest = Latest(CODEC, 1.0)
    for epoch, block in enumerate(frames):
        live_error.look(snapshot(latest.take([epoch], [block]), epoch, VEHICLE.boresight_body), 10**9)
    fixes = digested().fixes
    at = np.array([fixes[f"{axis}_m"][-4] for axis in "xyz"])
    assert live_error.error_m == pytest.approx(np.linalg.norm(at - rows[-4]["position_ecef_m"]), abs=1e-9)
    assert live_error.error_m > 0


def test_without_a_truth_file_there_is_no_error(tmp_path):
    live_error = LiveError(tmp_path / "nowhere", 0, 1)
    frames = epochs()[0]
    live_error.look(snapshot(of_frames(CODEC, frames[-1]), EPOCHS - 1, VEHICLE.boresight_body), 10**9)
    assert live_error.error_m is None


def test_every_fault_is_counted_though_most_epochs_are_not_drawn(tmp_path):
    """Frames damaged in epochs that are not drawn; the recorder's digest is the judge."""
    blocks = list(epochs()[0])
    blocks[10] = concat((blocks[10], batch([0x7AB], b"12345678")))
    blocks[70] = flipped(blocks[70], ranges(70)[0])
    blocks[71] = blocks[71][np.arange(len(blocks[71])) != ranges(71)[-1]]
    blocks[72] = concat((blocks[72], blocks[72][ranges(72)[1]]))
    blocks[61] = concat((blocks[61], batch([0x1ABCDEF0 | 0x8000_0000], b"12345678")))
    latest = Latest(CODEC, 1.0)
    latest.take(range(EPOCHS), blocks)
    digest = Digest(CODEC)
    for block in blocks:
        digest.feed(block)
    digest.finish()
    traffic = digest.counters
    assert latest.counters.reasons == traffic.reasons
    assert set(latest.counters.reasons) == {v.name for v in (
        Verdict.CORRUPTED, Verdict.REPEATED, Verdict.UNKNOWN_ID, Verdict.EXTENDED)}  # fmt: skip
    assert (latest.counters.lost, latest.counters.received) == (traffic.lost, traffic.received)
    assert latest.counters.lost == 2  # the frame that is missing, and the damaged one
    assert latest.load_most_percent == pytest.approx(digest.bits.max() / 1e4)
    window = Window(120, 24)
    viewed(tmp_path, window, blocks)
    assert "rejected 4: CORRUPTED 1, EXTENDED 1, REPEATED 1, UNKNOWN_ID 1" in window.drawn[0][3]


def ranges(epoch: int) -> list[int]:
    """Rows of the RANGE frames of an epoch."""
    block = epochs()[0][epoch]
    return np.flatnonzero(CODEC.kind_of[block.can_id] == CODEC.kinds["RANGE"].number).tolist()


def flipped(block: FrameBatch, row: int) -> FrameBatch:
    data = block.data.copy()
    data[row, 5] ^= 0x10
    return FrameBatch(block.t_ns, block.can_id, block.length, data)


@pytest.mark.parametrize(
    "missing", ["NAV_STATUS", "NAV_X", "ATT_Q01", "TIME_FINE", "RATE", "STATUS", "SV_CLOCK"]
)
def test_whatever_does_not_come_is_left_blank(tmp_path, missing):
    gone = CODEC.kinds[missing].number
    blocks = [block[CODEC.kind_of[block.can_id] != gone] for block in epochs()[0]]
    window = Window(80, 24)
    viewed(tmp_path, window, blocks)
    assert len(window.drawn[0]) > 15
    if missing == "NAV_STATUS":
        assert "no answer" in window.drawn[0][2]


@given(st.data())
def test_rubbish_never_raises(data):
    """Any frames at all in an epoch: they are counted, and a screen comes out."""
    block = epochs()[0][-1]
    rows = data.draw(st.lists(st.integers(0, len(block) - 1), min_size=1, max_size=40))
    noise = data.draw(st.lists(st.integers(0, 2**32 - 1), min_size=len(rows), max_size=len(rows)))
    payloads = data.draw(st.binary(min_size=8 * len(rows), max_size=8 * len(rows)))
    keep = data.draw(st.booleans())
    can_id = block.can_id.copy()
    can_id[rows] = can_id[rows] if keep else noise
    content = block.data.copy()
    content[rows] = np.frombuffer(payloads, np.uint8).reshape(-1, 8)
    frames = FrameBatch(block.t_ns, can_id, block.length, content)
    latest = Latest(CODEC, 1.0)
    accepted = latest.take([EPOCHS - 1], [frames])
    assert latest.counters.received == len(block) and len(accepted) + sum(
        latest.counters.reasons.values()
    ) == len(block)
    summary = summary_of(latest, snapshot(accepted, EPOCHS - 1, VEHICLE.boresight_body))
    assert screen(RunSummary("x", 1, 1.0, 2.0, None, 0, (summary,)), 80, 24)


def summary_of(latest: Latest, seen, name: str = "soyuz") -> CraftSummary:
    return CraftSummary(name, VEHICLE, latest, seen, 1.0, None)


def test_further_craft_have_a_line_each_and_the_rest_is_counted():
    latest = Latest(CODEC, 1.0)
    seen = snapshot(latest.take(range(EPOCHS), epochs()[0]), EPOCHS - 1, VEHICLE.boresight_body)
    craft = tuple(summary_of(latest, seen, f"craft-{i}") for i in range(12))
    lines = [plain(spans) for spans in screen(RunSummary("x", 1, 1.0, 2.0, None, 0, craft), 80, 24)]
    assert len(lines) <= 24 and sum(text.startswith("craft-") for text in lines) == 6
    assert "+6 more craft" in lines[-1]


def test_notes_are_shown_whole_and_said_again_at_the_end(tmp_path):
    window = Window(60, 24)
    view = viewed(tmp_path, window)
    note = "waiting for nobody on " + "x" * 80
    view.note(note)
    view._next = 0
    view.refresh()
    shown = "".join(text.strip() for text in window.drawn[-1][-2:])
    assert shown == note
    view.close()
    assert window.written == [note]


def test_before_the_first_epoch_notes_stay_on_the_ordinary_screen(tmp_path):
    window = Window(80, 24)
    view = LiveView(PLAN, tmp_path / "truth", window)
    view.note("waiting for the flight software")
    view.refresh()
    assert window.written == ["waiting for the flight software"] and not window.drawn


def test_a_terminal_that_is_held_is_passed_over_and_nothing_piles_up(tmp_path):
    window = Window(80, 24, ready=False)
    view = viewed(tmp_path, window)
    assert not window.drawn
    assert view._craft[0]._epochs == []
    window.ready, view._next = True, 0
    view.refresh()
    assert "lost 0  rejected 0" in window.drawn[0][3]


def test_in_a_pipe_or_when_asked_there_are_plain_lines(tmp_path, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    assert isinstance(
        display.open_display(PLAN, tmp_path / "truth", False), Progress
    )  # stderr is no terminal
    terminal = io.StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setattr("sys.stderr", terminal)
    assert isinstance(display.open_display(PLAN, tmp_path / "truth", False), LiveView)
    assert isinstance(display.open_display(PLAN, tmp_path / "truth", False, plain=True), Progress)
    assert isinstance(display.open_display(PLAN, tmp_path / "truth", True), Progress)
    monkeypatch.setenv("TERM", "dumb")
    assert isinstance(display.open_display(PLAN, tmp_path / "truth", False), Progress)
