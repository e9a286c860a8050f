"""What real receivers bring, on the flight software in C: marks of their own clocks, signals in plenty.

Epochs of a run, changed and sealed anew, are played to it and to ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.common.vehicle import ReceiverFigures, find, load
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.measurement.budget import budget_of
from gnss_hil.tools.command_line.main import main
from tests.support.feeder import Feeder, Frame, decoded, recorded
from tests.support.fsw_c import AGREEMENT_M, COPIES_M

pytestmark = pytest.mark.verifies(what="Assignment and commands, a second time")

TIME_FINE, RANGE, RATE, L2P = 0x012, 0x100, 0x101, 3
CHANNEL_AND_HEADER = (1 << 21) - 1
LIGHT_MPS = 299_792_458.0


@pytest.fixture(scope="module")
def epochs(tmp_path_factory) -> list[list[Frame]]:
    """Up to twelve epochs behind the first fix."""
    folder = tmp_path_factory.mktemp("runs") / "ours"
    assert main(["run", "--bus", "inline", "--duration", "60", "--out", str(folder), "--quiet"]) == 0
    epochs = recorded(folder / "bus.log")
    return epochs[: first_fix(our_answers(epochs)) + 12]


def first_fix(answers: Sequence[dict]) -> int:
    return next(k for k, answer in enumerate(answers) if "NAV_X" in answer)


def resealed(frame: Frame, word: int) -> Frame:
    """The frame with these eight bytes, but for a CRC that fits."""
    data = np.array([word], "<u8").view(np.uint8).reshape(1, 8)
    data[0, 0] = e2e.crc(np.array([frame[0]], np.uint32), data)[0]
    return frame[0], data.tobytes()


def word_of(frame: Frame) -> int:
    return int.from_bytes(frame[1], "little")


def our_answers(epochs: Sequence[Sequence[Frame]]) -> list[dict]:
    """What our flight software says to these epochs, decoded."""
    config = configure(load(find("soyuz-ms")), "patent")
    # The flight software in C knows nothing of what the vehicle file says of receivers.
    config = replace(config, budget=budget_of(ReceiverFigures(), config.options))
    state, answers = initial_state(config), []
    for epoch in epochs:
        ids, data = zip(*epoch, strict=True)
        block = batch(np.array(ids), np.array([list(payload) for payload in data], np.uint8))
        state, answer = flight_step(config, state, block)
        answers.append(decoded(zip(answer.can_id.tolist(), map(bytes, answer.data), strict=True)))
    return answers


def said(answer: dict, prefix: str, unit: str) -> np.ndarray:
    """Vector of the fix: NAV_X and so on, or NAV_VX."""
    return np.array([answer[f"NAV_{prefix.upper()}{a.upper()}"][0][f"{prefix}{a}_{unit}"] for a in "xyz"])


def agreed(fsw: Path, folder: Path, epochs: Sequence[Sequence[Frame]]) -> list[dict]:
    """Our answers, after comparing them with those of the flight software in C."""
    own = our_answers(epochs)
    with Feeder(fsw, folder) as bench:
        theirs = [decoded(bench.play(epoch)) for epoch in epochs]
    for ours, other in zip(own, theirs, strict=True):
        for name in ("no_fix", "mode", "measurements", "satellites"):
            assert str(ours["NAV_STATUS"][0][name]) == str(other["NAV_STATUS"][0][name])
        if "NAV_X" in ours:
            counts = ours["NAV_STATUS"][0]
            alone = counts["measurements"] == counts["satellites"]
            agreement_m = AGREEMENT_M if alone else COPIES_M
            assert said(ours, "", "m") == pytest.approx(said(other, "", "m"), abs=agreement_m)
            assert said(ours, "v", "mps") == pytest.approx(said(other, "v", "mps"), abs=0.0005)
    return own


def shown_by(clock: int, epochs: Sequence[Sequence[Frame]]) -> list[list[Frame]]:
    """Epochs whose marks a clock shows: k + 1, that of domain k."""
    return [
        [resealed(f, word_of(f) | clock << 54) if f[0] == TIME_FINE else f for f in epoch] for epoch in epochs
    ]


def test_marks_of_a_clock_that_no_receiver_has_make_no_fix(fsw, epochs, tmp_path):
    """Of another clock for once a mark is not believed by ours, whatever it shows."""
    known = first_fix(our_answers(epochs))
    never = agreed(fsw, tmp_path, shown_by(8, epochs[: known + 2]))
    assert str(never[known]["NAV_STATUS"][0]["no_fix"]) == "TOO_FEW_SATELLITES"
    once = [*epochs[: known + 1], *shown_by(8, epochs[known + 1 : known + 2]), epochs[known + 2]]
    reasons = [str(answer["NAV_STATUS"][0]["no_fix"]) for answer in our_answers(once)[known:]]
    assert reasons == ["FIX", "NO_TIME_MARK", "FIX"]


def test_a_mark_shown_by_a_clock_moves_both_alike(fsw, epochs, tmp_path):
    """Marks said to be domain 0's, and such of a clock that no receiver has."""
    moved, still = agreed(fsw, tmp_path, shown_by(1, epochs)), our_answers(epochs)
    moved_m = []
    for k in range(first_fix(still), len(epochs)):
        if "NAV_X" not in moved[k]:
            continue
        away_m = said(moved[k], "", "m") - said(still[k], "", "m")
        along_m = said(still[k], "v", "mps") * (still[k]["NAV_CLOCK"][0]["bias_m"] / LIGHT_MPS)
        assert away_m == pytest.approx(along_m, abs=0.001)
        moved_m.append(np.linalg.norm(away_m))
    assert len(moved_m) > 5 and min(moved_m) > 0.01


@pytest.mark.verifies(
    "flightsw/measurement/observables.py",
    "flightsw/records/ranges.py",
    what="One signal of a satellite counts",
    by="a rule of ours; the C flight software has it too",
    status="modelled",
)
def test_a_second_signal_of_a_satellite_is_not_another_satellite(fsw, epochs, tmp_path):
    """A channel of receiver 1 made to deliver on L2P, 10 m longer, the satellite that another has."""
    until = first_fix(our_answers(epochs)) + 1  # before any channel obeys

    def doubled(epoch):
        at = {(f[0], f[1][2] & 31): f for f in epoch if RANGE <= f[0] < RANGE + 10}
        first, *_, last = sorted({channel for _, channel in at}) or (0, 0)
        if first == last:
            return epoch
        for can_id in range(RANGE, RANGE + 10):
            frame = at[can_id, last]
            word = word_of(at[can_id, first]) & ~CHANNEL_AND_HEADER | word_of(frame) & CHANNEL_AND_HEADER
            if can_id == RANGE:
                word += 100_000 << 21
            if can_id == RATE:
                word = word & ~(0xF << 21) | L2P << 21
            at[can_id, last] = resealed(frame, word)
        return [at.get((f[0], f[1][2] & 31), f) for f in epoch]

    own = agreed(fsw, tmp_path, [doubled(epoch) for epoch in epochs[:until]])[-1]
    alone = our_answers(epochs[:until])[-1]
    fewer = alone["NAV_STATUS"][0]["measurements"] - own["NAV_STATUS"][0]["measurements"]
    assert "NAV_X" in own and fewer == 1
