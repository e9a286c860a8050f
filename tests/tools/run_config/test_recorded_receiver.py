"""What `run replay` makes of a scenario."""

from __future__ import annotations

from pathlib import Path

from gnss_hil.emulator.assemble import recorded as assemble
from gnss_hil.tools.run_config import recorded_receiver
from gnss_hil.tools.run_config.config import Overrides


def test_the_span_of_a_file_leaves_what_else_the_scenario_says_of_time(monkeypatch):
    span = {"start_gps": "2010-07-27T00:00:00", "duration_s": 86400.0, "epoch_interval_s": 10.0}
    monkeypatch.setattr(assemble, "span_of", lambda path, craft: dict(span))
    document = {
        "time": {"start_gps": "2001-01-01T00:00:00", "duration_s": 60, "orientation": "finals2000A.all"},
        "sky": {"gps": "nominal"},
        "craft": [{"name": "observed", "observations": {}}],
    }
    recorded_receiver.override(document, Overrides(obs=Path("grace.obs"), interval_s=30.0))
    assert document["time"] == {**span, "epoch_interval_s": 30.0, "orientation": "finals2000A.all"}
