"""The receivers' clock as the fix has it: bias, its error, drift."""

from __future__ import annotations

import numpy as np

from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.error_plots import sigma_bands, view
from gnss_hil.tools.report.plot import Json, Plot, axis, piled, usual_span
from gnss_hil.tools.report.time_series import NO_FIX, shades, trace

_BANDS = (
    "Bands: 1 and 3 sigma as published, mostly of the delay that all receivers share: one draw a run, none "
    "without interchannel_bias."
)


def clock(craft: Craft) -> Plot:
    """Bias and drift of the lowest oscillator, and the bias's error where truth was kept."""
    title, t_ns, fixes = "Receiver clock", craft.t_ns, craft.fixes
    bias, drift = fixes["clock_bias_m"], fixes["clock_drift_mps"]
    if np.isnan(bias).all():
        return Plot.missing(title, NO_FIX)
    rows: list[tuple[Json, list[Json]]] = [(axis("bias [m]"), [trace("bias", t_ns, bias, "--accent")])]
    words = "As the flight software has it, of the oscillator with the lowest number; 1 m is 3.34 ns."
    if craft.clock is not None:
        error, sigma = craft.clock.value_m, fixes["sigma_clock_bias_m"]
        limit = view(error, sigma)
        rows.append((axis("bias - truth [m]", range=[-limit, limit]),
                     [*sigma_bands(t_ns, sigma), trace("bias - truth", t_ns, error, "--accent",
                                                       line={"width": 1})]))  # fmt: skip
        words += " No sigma is published." if np.isnan(sigma).all() else f" {_BANDS}"
    if np.isnan(drift).all():
        words += " No drift is published."
    else:
        rows.append((axis("drift [m/s]", range=usual_span(drift)), [trace("drift", t_ns, drift, "--accent")]))
    shapes, shaded = shades(craft)
    return Plot(title, f"{words} {shaded}", piled(t_ns, rows, shapes=shapes, showlegend=False),
                height=80 + 130 * len(rows), wide=True)  # fmt: skip
