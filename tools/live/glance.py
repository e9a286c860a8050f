"""A glance at the last navigation block, for the progress line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import VALUES


@dataclass(frozen=True, slots=True)
class Standing:
    """simulated_s since the start, and what the last epoch's navigation said."""

    simulated_s: float
    mode: str = ""
    satellites: int = 0
    pdop: float = float("nan")


def standing(codec: Codec, frames: FrameBatch, simulated_s: float) -> Standing:
    """What the navigation frames of one epoch say."""
    rows = np.flatnonzero(frames.can_id == codec.can_id_of["NAV_STATUS", 0])
    if not len(rows):
        return Standing(simulated_s)
    said = {name: values[0] for name, values in codec.decode("NAV_STATUS", frames.data[rows[:1]]).items()}
    mode = VALUES["NavMode"].get(int(said["mode"]), "")
    return Standing(simulated_s, mode, int(said["satellites"]), float(said["pdop"]))
