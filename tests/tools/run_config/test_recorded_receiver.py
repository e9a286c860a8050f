"""What `run replay` makes of a scenario."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gnss_hil.emulator.assemble import recorded as assemble
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config import recorded_receiver
from gnss_hil.tools.run_config.config import Overrides


def test_the_span_of_a_file_leaves_what_else_the_scenario_says_of_time(monkeypatch):
    span = {"start_gps": "2010-07-27T00:00:00", "duration_s": 86400.0, "epoch_interval_s": 10.0}
    monkeypatch.setattr(assemble, "span_of", lambda path, craft: dict(span))
    monkeypatch.setattr(assemble, "signals_there", lambda path, craft: {"L1CA": np.ones(1, bool)})
    document = {
        "time": {"start_gps": "2001-01-01T00:00:00", "duration_s": 60, "orientation": "finals2000A.all"},
        "sky": {"gps": "nominal"},
        "craft": [{"name": "observed", "observations": {}}],
    }
    recorded_receiver.override(document, Overrides(obs=Path("grace.obs"), interval_s=30.0))
    assert document["time"] == {**span, "epoch_interval_s": 30.0, "orientation": "finals2000A.all"}


def chosen(monkeypatch, there, heard, ionosphere_free):
    """Signals for a file in which signals have as many observations as `there` says, of a hundred."""
    masks = {name: np.arange(100) < there.get(name, 0) for name in SIGNALS}
    monkeypatch.setattr(assemble, "signals_there", lambda path, craft: masks)
    document = {
        "sky": {"gps": "none", "glonass": "none"} | dict.fromkeys(heard, "x.nav"),
        "craft": [{"name": "observed", "observations": {}}],
    }
    overrides = Overrides(obs=Path("x.obs"), ionosphere_free=ionosphere_free, duration_s=1.0)
    monkeypatch.setattr(assemble, "span_of", lambda path, craft: {})
    recorded_receiver.override(document, overrides)
    return document["craft"][0]["observations"]["signals"]


PAIRS = [
    ({"L1P": 90, "L2P": 90, "L1CA": 90}, ["L1P", "L2P"]),
    ({"L1CA": 100, "L2P": 98}, ["L1CA", "L2P"]),
    ({"L1CA": 100, "L2C": 98}, ["L1CA", "L2C"]),
    ({"L1CA": 100, "L5": 60}, ["L1CA", "L5"]),
    ({"L1CA": 100, "L2P": 98, "L2C": 75, "L5": 50}, ["L1CA", "L2P"]),
    ({"L1CA": 100, "L2P": 98, "L2C": 95, "L5": 50}, ["L1CA", "L2C"]),
]  # fmt: skip


@pytest.mark.parametrize(("there", "signals"), PAIRS)
def test_a_pair_is_one_of_the_file(monkeypatch, there, signals):
    """The preferred one, unless another has more observations by a tenth."""
    assert chosen(monkeypatch, there, ["gps"], ionosphere_free=True) == signals


def test_each_system_has_signals_of_its_own(monkeypatch):
    there = {"L1CA": 50, "L2C": 50, "L1OF": 40, "L2OF": 40}
    assert chosen(monkeypatch, there, ["gps", "glonass"], True) == ["L1CA", "L2C", "L1OF", "L2OF"]
    assert chosen(monkeypatch, there, ["gps", "glonass"], False) == ["L1CA", "L1OF"]


def test_a_system_without_what_is_asked_leaves_the_others_be(monkeypatch):
    assert chosen(monkeypatch, {"L1CA": 50, "L2C": 50, "L1OF": 40}, ["gps", "glonass"], True) == [
        "L1CA",
        "L2C",
    ]
    assert chosen(monkeypatch, {"L1P": 50}, ["gps", "glonass"], False) == ["L1P"]


def test_a_file_without_any_pair_is_refused(monkeypatch):
    with pytest.raises(
        Mistake, match=r"x\.obs: no pair of pseudoranges of two frequencies of gps or glonass, w"
    ):
        chosen(monkeypatch, {"L1CA": 50, "L2OF": 50}, ["gps", "glonass"], True)
