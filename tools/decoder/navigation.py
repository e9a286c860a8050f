"""The fix and the attitude of each epoch, as their frames have them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.block import Block

_POSITION, _POSITION_VELOCITY = 1, 2  # NavMode
_FIX_SIGNALS = {
    **{f"NAV_{a}": (f"{a.lower()}_m",) for a in "XYZ"},
    **{f"NAV_V{a}": (f"v{a.lower()}_mps",) for a in "XYZ"},
    "NAV_STATUS": (
        "mode", "no_fix", "satellites", "measurements", "pdop", "tested", "excluded_satellites",
        "excluded_receivers",
    ),
    "NAV_SIGMA": ("sigma_x_m", "sigma_y_m", "sigma_z_m"),
    "NAV_CORR": ("rho_xy", "rho_xz", "rho_yz"),
    "NAV_VSIGMA": ("sigma_vx_mps", "sigma_vy_mps", "sigma_vz_mps"),
    "NAV_VCORR": ("rho_vxy", "rho_vxz", "rho_vyz"),
}  # fmt: skip
_CLOCK_SIGNALS = {
    "NAV_CLOCK": {"clock_bias_m": "bias_m", "clock_domain": "item"},
    "NAV_DRIFT": {"clock_drift_mps": "drift_mps"},
    "NAV_CLOCK_SIGMA": {"sigma_clock_bias_m": "sigma_bias_m", "sigma_clock_drift_mps": "sigma_drift_mps"},
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
    for kind, names in _CLOCK_SIGNALS.items():
        out |= _of_lowest_domain(block, kind, names)
    out["sigma_clock_drift_mps"][np.isnan(out["clock_drift_mps"])] = np.nan
    return out


def _of_lowest_domain(block: Block, kind: str, names: Mapping[str, str]) -> dict[str, NDArray]:
    """Signals of a kind that comes for each clock, (e,) by the names they are given: of the lowest domain."""
    clocks = block[kind]
    item = clocks["item"]
    order = np.argsort(-item, kind="stable")  # the lowest domain is written last and stands
    domains = order[np.isin(item[order], _DOMAINS)]
    out = {name: np.full(block.epochs, np.nan) for name in names}
    for name, signal in names.items():
        out[name][clocks.epoch[domains]] = clocks[signal][domains]
    return out
