"""A glance at the last navigation block, for the progress line."""

from __future__ import annotations

import numpy as np

from dbc.codec import Codec
from dbc.contract import VALUES
from dbc.frames import FrameBatch
from tools.progress import Standing


def standing(codec: Codec, frames: FrameBatch, simulated_s: float, truth: np.void | None = None) -> Standing:
    """What the navigation frames of one epoch say; the error if the epoch's truth is given."""
    said = {}
    for kind in ("NAV_STATUS", "NAV_X", "NAV_Y", "NAV_Z"):
        rows = np.flatnonzero(frames.can_id == codec.can_id_of[kind, 0])
        if len(rows):
            said |= {name: values[0] for name, values in codec.decode(kind, frames.data[rows[:1]]).items()}
    if "mode" not in said:
        return Standing(simulated_s)
    error_m = None
    if truth is not None and said["mode"] and {"x_m", "y_m", "z_m"} <= said.keys():
        error_m = float(np.linalg.norm([said[f"{a}_m"] for a in "xyz"] - truth["position_ecef_m"]))
    mode = VALUES["NavMode"].get(int(said["mode"]), "")
    return Standing(simulated_s, mode, int(said["satellites"]), float(said["pdop"]), error_m)
