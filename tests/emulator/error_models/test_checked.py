"""Error models that fail: one line with the model's name, never a run without fixes."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.dbc.process import command_line
from gnss_hil.emulator import __main__ as shell
from gnss_hil.emulator.assemble.shared import models_of
from gnss_hil.emulator.error_models.base import (
    AttitudeTerm,
    Epochs,
    LinkTerm,
    ObservableTerm,
    PathModel,
    PathTerm,
    ReportTerm,
    Row,
    Stage,
    TrackingTerm,
    VisibilityTerm,
)
from gnss_hil.emulator.error_models.checked import ModelError, checked
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.emulator.signal import antenna_patterns, link_budget

pytestmark = pytest.mark.verifies(
    "emulator/error_models/checked.py",
    what="Error models that fail",
    by="models of the tests' own with answers of every wrong kind, at every stage and in whole runs",
    status="modelled",
)

NAN, INF = float("nan"), float("inf")
EPOCHS = Epochs(0, 2, 0, 1)
SIGNALS = (1, 2, 3)
SEEN = SimpleNamespace(sat=SIGNALS)
REPORT = SimpleNamespace(pos_ecef_m=np.zeros((1, 2, 4, 3)))
SOME = np.zeros(3)
NOWHERE = np.array([0.0, NAN, 0.0])
LEVEL = antenna_patterns.receive((antenna_patterns.cosine_law(4.0, -6.0),) * 4, 0.0)


@dataclass(frozen=True)
class Told(PathModel):
    """A model that says what it is told to; an exception it raises."""

    answer: Any

    def block(self, at):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    def step(self, state, at, epoch):
        return "state", self.block(at)


def answered(stage, answer, at):
    model = checked(Told(answer), "mine", stage, "craft soyuz", 4)
    return model.block(at) if stage.asks == "block" else model.step(None, at, 0)[1]


FAULTS = [
    (Stage.BROADCAST, ReportTerm(off_clock_m=NAN), REPORT, "off_clock_m is not finite"),
    (Stage.BROADCAST, ReportTerm(SOME), REPORT, r"off_ecef_m has shape \(3,\); asked for is \(1, 2, 4, 3\)"),
    (Stage.OSCILLATOR, np.full((2, 2, 8), NAN), EPOCHS, "the clock is not finite"),
    (Stage.OSCILLATOR, np.zeros((2, 8)), EPOCHS, r"the clock has shape \(2, 8\); asked for is \(2, 2, 8\)"),
    (Stage.OSCILLATOR, np.full((2, 2, 8), -2.0), EPOCHS, "the clock is more than 1.5 s"),
    (Stage.LATCH, np.array([0.0, NAN]), EPOCHS, "the latch's offset is not finite"),
    (Stage.LATCH, np.array([0.0, -2.0]), EPOCHS, "the latch's offset is more than 1.5 s"),
    (Stage.LATCH, 0.0, EPOCHS, r"the latch's offset has shape \(\); asked for is \(2,\)"),
    (Stage.ATTITUDE, AttitudeTerm(np.zeros(3), np.zeros((2, 3))), EPOCHS, r"angle_rad has shape \(3,\)"),
    (Stage.ATTITUDE, AttitudeTerm(np.zeros((2, 3)), np.full((2, 3), INF)), EPOCHS, "rate_rps is not finite"),
    (Stage.LINK, LinkTerm(noise_wphz=NAN), None, "noise_wphz is not finite"),
    (Stage.LINK, LinkTerm(noise_wphz=SOME), None, r"noise_wphz has shape \(3,\); asked for is \(4,\)"),
    (Stage.LINK, LinkTerm(loss_db=INF), None, "loss_db is not finite"),
    (Stage.LINK, LinkTerm(antennas=4.0), None, "antennas is float; asked for is Receive"),  # pyright: ignore[reportArgumentType]
    (Stage.LINK, LinkTerm(antennas=antenna_patterns.Receive(LEVEL.right_dbi * NAN, LEVEL.row)), None,
     "antennas.right_dbi is not finite"),
    (Stage.LINK, LinkTerm(transmitters=link_budget.Transmit(np.full((1, 721), NAN), LEVEL.row)), None,
     "transmitters.level_dbwm2 is not finite"),
    (Stage.VISIBILITY, True, None, "answers bool; asked for is VisibilityTerm"),
    (Stage.PATH, 5.0, SIGNALS, "answers float; asked for is PathTerm"),
    (Stage.PATH, PathTerm(range_m=NOWHERE), SIGNALS, "range_m is not finite"),
    (Stage.PATH, PathTerm(phase_m=-INF), SIGNALS, "phase_m is not finite"),
    (Stage.PATH, PathTerm(rate_mps=np.zeros(2)), SIGNALS, r"rate_mps has shape \(2,\); asked for is \(3,\)"),
    (Stage.PATH, PathTerm(turns_cyc=NOWHERE), SIGNALS, "turns_cyc is not finite"),
    (Stage.PATH, PathTerm(level_db=NOWHERE), SIGNALS, "level_db is not finite"),
    (Stage.PATH, PathTerm(level_db=INF), SIGNALS, "level_db is not finite"),
    (Stage.PATH, PathTerm(range_m=None), SIGNALS, "range_m is NoneType; asked for are numbers"),  # pyright: ignore[reportArgumentType]
    (Stage.PATH, KeyError("soyuz"), SIGNALS, "KeyError: 'soyuz'"),
    (Stage.TRACKING, TrackingTerm(SOME), SIGNALS, "half_cycles is not of whole numbers"),  # pyright: ignore[reportArgumentType]
    (Stage.TRACKING, TrackingTerm(np.zeros(2, int)), SIGNALS, r"half_cycles has shape \(2,\)"),
    (Stage.OBSERVABLE, ObservableTerm(range_m=NAN), SEEN, "range_m is not finite"),
    (Stage.OBSERVABLE, ObservableTerm(phase_m=NOWHERE), SEEN, "phase_m is not finite"),
    (Stage.OBSERVABLE, ObservableTerm(rate_mps=INF), SEEN, "rate_mps is not finite"),
    (Stage.OBSERVABLE, ObservableTerm(level_db=-INF), SEEN, "level_db is not finite"),
    (Stage.OBSERVABLE, ZeroDivisionError("division by zero"), SEEN, "ZeroDivisionError: division by zero"),
    (Stage.FRAMES, None, EMPTY, "answers NoneType; asked for is FrameBatch"),
]  # fmt: skip


@pytest.mark.parametrize("stage, answer, at, fault", FAULTS)
def test_a_wrong_answer_is_one_line_with_row_stage_and_craft(stage, answer, at, fault):
    name = rf"^error model 'mine' \(stage {stage.name.upper()}, craft soyuz\): {fault}"
    with pytest.raises(ModelError, match=name) as caught:
        answered(stage, answer, at)
    assert "\n" not in str(caught.value)


def test_every_stage_has_its_check():
    stages = {stage.name.upper() for stage, *_ in FAULTS}
    assert stages == {name for name in vars(Stage) if name.isupper()}


RIGHT = [
    (Stage.PATH, PathTerm(SOME, 1.0, 2, SOME, np.full(3, -INF)), SIGNALS),
    (Stage.PATH, PathTerm(level_db=-INF), SIGNALS),
    (Stage.OBSERVABLE, ObservableTerm(range_m=1e9), SEEN),
    (Stage.LINK, LinkTerm(noise_wphz=np.ones(4), antennas=LEVEL, transmitters=link_budget.isotropic()), None),
    (Stage.TRACKING, TrackingTerm(np.zeros(3, int)), SIGNALS),
    (Stage.TRACKING, TrackingTerm(), None),
    (Stage.BROADCAST, ReportTerm(np.zeros((1, 2, 4, 3)), 1.0), REPORT),
    (Stage.FRAMES, EMPTY, EMPTY),
]


@pytest.mark.parametrize("stage, answer, at", RIGHT)
def test_a_right_answer_is_handed_on(stage, answer, at):
    assert answered(stage, answer, at) is answer


def test_functions_inside_a_term_are_looked_at_when_they_are_called():
    candidate = np.ones((2, 4, 3), bool)
    term = answered(Stage.VISIBILITY, VisibilityTerm(lambda hides: hides[0], lambda level: level > 30), None)
    with pytest.raises(
        ModelError, match=r"hides: answers an array of shape \(4, 3\); asked for are booleans"
    ):
        term.hides(candidate)
    assert not term.holds(np.full((2, 4, 3), 20.0)).any()
    term = answered(Stage.TRACKING, TrackingTerm(collection_ns=lambda system, t_ns: 1e9 + t_ns / 3), None)
    with pytest.raises(ModelError, match="collection_ns: its answer is not of whole numbers"):
        term.collection_ns(np.zeros(3, int), np.arange(3))


def test_a_model_of_the_path_inherits_its_flags():
    with pytest.raises(ModelError, match=r"'mine' \(stage PATH, sky\): SimpleNamespace is no PathModel"):
        checked(SimpleNamespace(block=lambda at: PathTerm()), "mine", Stage.PATH, "sky")


def test_what_cannot_be_built_has_its_name(monkeypatch):
    def build(params, context):
        return {}["gain"]

    monkeypatch.setitem(FACTORS, "mine", Row("mine", Factor, Stage.LINK, "made up", build))
    with pytest.raises(ModelError, match=r"^error model 'mine' \(stage LINK, sky\): KeyError: 'gain'$"):
        models_of({"mine": Factor()}, None, "sky")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    "case, line",
    [
        ("unbounded", "(stage PATH, craft soyuz): range_m is not finite"),
        ("lost", "(stage LATCH, craft soyuz): the latch's offset is not finite"),
        ("breaking", "(stage OBSERVABLE, craft soyuz): ZeroDivisionError: division by zero"),
    ],
)
def test_a_run_ends_with_one_line(case, line, tmp_path):
    run = ["run", "soyuz", "--duration", "60", "--bus", "inline", "--quiet", "--out", str(tmp_path / "run")]
    command = [sys.executable, "-m", "tests.support.faulty_model", case, *run]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"gnss-hil: error model 'faulty' {line}"
    assert "Traceback" not in done.stderr and "Warning" not in done.stderr


def test_the_emulators_shell_says_it_too(capsys):
    line = "error model 'mine' (stage PATH, sky): range_m is not finite"

    def play():
        raise ModelError(line)

    assert command_line.guarded("emulator", lambda stop: shell._told(play)) == 1
    assert capsys.readouterr().err == f"emulator: {line}\n"
