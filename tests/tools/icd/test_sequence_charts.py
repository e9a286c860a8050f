"""The sequence charts, played: what the protocol's two sides answer is what is drawn."""

from __future__ import annotations

import re
from importlib import resources

import pytest

from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.master_protocol import Barrier, Exchange
from gnss_hil.dbc.lockstep.slave_protocol import Slave, Task
from gnss_hil.tools.icd.sequence import EMULATOR, FLIGHT, Chart, Sent, charts
from tests.support import lockstep_frames
from tests.support.icd_pages import tree
from tests.support.lockstep_frames import CODEC, SESSION

pytestmark = pytest.mark.verifies(
    what="Interface control document: formulas, sequence charts, an epoch on a time axis",
)

CHARTS = tuple(charts().values())
START, COMMAND, LOST_SYNC, RESTART = (
    charts()[title]
    for title in (
        "Start",
        "A command and its answer",
        "A lost SYNC, a lost DONE",
        "The emulator starts again",
    )
)

EPOCH = {"k": 10, "k+1": 11, "k+n": 15, "n-1": 20, "n": 21, "0": 0}
SESSIONS = {"session": SESSION, "old session": SESSION, "new session": SESSION + 1}
_BENCH = re.compile(r"BENCH_(SYNC|DONE|END)\{([^,]+), ([^,]+), (\w+)\}")


def epoch_of(sent: Sent) -> int:
    block = re.match(r"block (\S+):", sent.frames)
    return EPOCH[block[1] if block else _BENCH.match(sent.frames)[3]]


def session_of(chart: Chart, sent: Sent) -> int:
    """A block is of the session that the next bench frame names."""
    rest = chart.arrows[chart.arrows.index(sent) :]
    return SESSIONS[next(found[2] for found in (_BENCH.match(a.frames) for a in rest) if found)]


def kind(sent: Sent) -> str:
    found = _BENCH.match(sent.frames)
    return found[1] if found else "HEARTBEAT" if "HEARTBEAT" in sent.frames else "block"


def of_emulator(chart: Chart, sent: Sent) -> FrameBatch:
    epoch, session = epoch_of(sent), session_of(chart, sent)
    if kind(sent) == "block":
        return lockstep_frames.block(epoch, session=session)
    if kind(sent) == "SYNC":
        return lockstep_frames.sync(epoch, 6, session)
    return messages.encode(messages.END_ID, session, epoch, messages.END_REASON["COMPLETED"])


def drawn_answers(chart: Chart) -> list[tuple[str, int, int]]:
    """DONEs that flight sends in a chart, lost or not."""
    return [
        ("DONE", session_of(chart, a), epoch_of(a))
        for a in chart.arrows
        if a.by == FLIGHT and kind(a) == "DONE"
    ]


def played_answers(chart: Chart) -> tuple[list[tuple[str, int, int]], list[Task]]:
    """What a flight node answers to what is drawn of the emulator."""
    slave, answers, tasks = Slave(CODEC), [], []
    for sent in chart.arrows:
        if sent.by != EMULATOR or sent.lost:
            continue
        for work in slave.hear(of_emulator(chart, sent), 0.0):
            tasks.append(work.task)
            frames = work.block
            if work.task is Task.STEP:
                frames = slave.answer(lockstep_frames.navigation(1))
            spoken = lockstep_frames.bench_in(frames, session_of(chart, sent), epoch_of(sent))
            answers += [
                ("DONE", frame.session, frame.epoch) for frame in spoken if frame.can_id == messages.DONE_ID
            ]
    return answers, tasks


@pytest.mark.parametrize("chart", [c for c in CHARTS if c not in (COMMAND,)], ids=lambda c: c.title)
def test_the_flight_side_answers_as_drawn(chart):
    assert played_answers(chart)[0] == drawn_answers(chart) != []


def test_a_repeated_sync_is_answered_without_a_step():
    assert played_answers(LOST_SYNC)[1] == [Task.STEP, Task.REPEAT, Task.STEP]


def test_the_emulator_takes_the_answers_as_drawn():
    """The master's side of every chart with epochs: an epoch is answered where a DONE arrives."""
    for chart in CHARTS:
        exchange, answered, opened = None, [], []
        for sent in chart.arrows:
            if sent.by == EMULATOR and kind(sent) == "block" and epoch_of(sent) not in opened:
                session = session_of(chart, sent)
                exchange = (
                    exchange if exchange and exchange.session == session else Exchange(CODEC, session, {})
                )
                exchange.open(epoch_of(sent), lockstep_frames.measurements(6))
                opened.append(epoch_of(sent))
            elif kind(sent) == "DONE" and not sent.lost and exchange:
                done = lockstep_frames.done(epoch_of(sent), 3, session_of(chart, sent))
                exchange.hear(concat((lockstep_frames.navigation(1), done)))
                answered += [epoch_of(sent)] * exchange.answered
        assert answered == opened, chart.title


def test_the_barrier_opens_at_the_heartbeat_drawn():
    hearts = [a for a in START.arrows if kind(a) == "HEARTBEAT"]
    first_block = next(k for k, a in enumerate(START.arrows) if kind(a) == "block")
    assert START.arrows[:first_block] == hearts
    barrier = Barrier(CODEC)
    assert barrier.missing
    barrier.hear(lockstep_frames.heartbeat(contract_hash=1))
    assert barrier.missing
    barrier.hear(lockstep_frames.heartbeat())
    assert not barrier.missing


def test_a_new_session_starts_from_nothing():
    slave, fresh = Slave(CODEC), []
    for sent in RESTART.arrows:
        if sent.by == EMULATOR:
            for work in slave.hear(of_emulator(RESTART, sent), 0.0):
                fresh.append(work.fresh)
                slave.answer(lockstep_frames.navigation(1))
    assert fresh == [True, True]


def test_the_drawings_have_every_arrow_of_their_charts():
    arrows = [
        (e.get("data-by"), e.get("data-frames"))
        for e in tree().iter()
        if e.get("data-frames") and e.get("data-by")
    ]
    assert arrows == [(a.by, a.frames) for chart in CHARTS for a in chart.arrows]


def test_every_line_of_a_chart_is_a_step():
    """And every one of the file is read: arrows, notes and pauses."""
    page = resources.files("gnss_hil.tools.icd").joinpath("sequences.md").read_text("utf-8")
    lines = re.findall(r"^    (?!participant)\S.*$", page, re.MULTILINE)
    assert len(CHARTS) == page.count("```mermaid") == 6
    assert sum(len(chart.steps) for chart in CHARTS) == len(lines) > 60
    assert all(re.match(r"(?:E(?:->>|-x)F|F(?:->>|-x)E|Note )", line.strip()) for line in lines)


def test_names_in_the_charts_are_names_of_the_contract():
    known = {name for name, _ in CODEC.can_id_of} | {"COMMANDs", "RX2_COMMAND", "RX2_ACK", "FLIGHT_HEARTBEAT"}
    for chart in CHARTS:
        for sent in chart.arrows:
            label = re.sub(r"\{[^}]*\}", "", sent.frames)
            spoken = set(
                re.findall(r"\b[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+\b|\bCOMMANDs\b|\bTAG\b|\bSTATUS\b", label)
            )
            assert spoken <= known, label
