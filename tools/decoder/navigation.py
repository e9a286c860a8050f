"""The fix and the attitude of each epoch, as their frames have them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.messages import VALUES
from gnss_hil.tools.decoder.block import Block

_POSITION, _POSITION_VELOCITY = 1, 2  # NavMode
_FIX_SIGNALS = {
    **{f"NAV_{a}": (f"{a.lower()}_m",) for a in "XYZ"},
    **{f"NAV_V{a}": (f"v{a.lower()}_mps",) for a in "XYZ"},
    "NAV_STATUS": ("mode", "no_fix", "satellites", "measurements", "pdop"),
    "NAV_SIGMA": ("sigma_x_m", "sigma_y_m", "sigma_z_m"),
    "NAV_CORR": ("rho_xy", "rho_xz", "rho_yz"),
}
_ATTITUDE_SIGNALS = {
    "ATT_Q01": ("q0", "q1"),
    "ATT_Q23": ("q2", "q3"),
    "ATT_RATE": ("wx_rps", "wy_rps", "wz_rps"),
}
_DOMAINS = tuple(raw for raw, label in VALUES["ClockItem"].items() if label.startswith("DOMAIN_"))


def _once_an_epoch(block: Block, signals: Mapping[str, tuple[str, ...]]) -> dict[str, NDArray]:
    """Signals of kinds that come once an epoch, (e,) each, nan where they did not come."""
    return {name: block.grid(kind, name) for kind, names in signals.items() for name in names}


def attitudes(block: Block) -> dict[str, NDArray]:
    """(e,) q0 .. q3 body from ECEF and rates wx_rps .. wz_rps; nan where their frames are missing."""
    return _once_an_epoch(block, _ATTITUDE_SIGNALS)


def fixes(block: Block) -> dict[str, NDArray]:
    """The navigation block of each epoch, (e,) arrays; nan where there is none.

    A fix is valid if all frames came that its mode promises. One of mode POSITION has no velocity.
    """
    out = _once_an_epoch(block, _FIX_SIGNALS)
    position_only = out["mode"] == _POSITION
    for axis in "xyz":
        out[f"v{axis}_mps"][position_only] = np.nan
    placed, moving = (
        ~np.isnan([out[name.format(a)] for a in "xyz"]).any(axis=0) for name in ("{}_m", "v{}_mps")
    )
    out["reported"] = ~np.isnan(out["mode"])
    out["valid"] = placed & (position_only | moving & (out["mode"] == _POSITION_VELOCITY))
    clocks = block["NAV_CLOCK"]
    item = clocks["item"]
    order = np.argsort(-item, kind="stable")  # the lowest domain is written last and stands
    domains = order[np.isin(item[order], _DOMAINS)]
    out["clock_bias_m"] = np.full(block.epochs, np.nan)
    out["clock_bias_m"][clocks.epoch[domains]] = clocks["bias_m"][domains]
    return out
