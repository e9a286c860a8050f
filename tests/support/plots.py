"""What a report's plots carry: arrays out of plotly's encoding, and a craft made by hand to draw."""

from __future__ import annotations

import base64
from types import SimpleNamespace

import numpy as np

from gnss_hil.tools.results.outages import stretches

T0_NS = 1_035_677_736_000_000_000


def array(coded) -> np.ndarray:
    """A typed array of plotly as numbers."""
    return np.frombuffer(base64.b64decode(coded["bdata"]), f"<{coded['dtype']}").astype(float)


def named(figure, name: str) -> list[dict]:
    """Traces of that name."""
    return [trace for trace in figure["data"] if trace["name"] == name]


def craft(epochs: int, **more) -> SimpleNamespace:
    """A craft with a fix at every second's mark."""
    t_ns = T0_NS + np.arange(epochs) * 10**9
    fixes = {"t_ns": t_ns, "valid": np.ones(epochs, bool), "no_fix": np.zeros(epochs)}
    own = {"t_ns": t_ns, "interval_ns": 10**9, "without_fix": stretches(t_ns, fixes, 10**9)}
    return SimpleNamespace(**(own | more))
