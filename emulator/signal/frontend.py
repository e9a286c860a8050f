"""Noise of a receiver's front end: from antenna temperature, losses and noise figures to one temperature.

All temperatures are referred to the antenna's terminals, where the gains of patterns belong.
Source of the formulas: H. Friis, Noise Figures of Radio Receivers, Proc. IRE 32(7), 1944, 419-422;
Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., appendix B
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import Floats
from gnss_hil.emulator.signal.simple_link_budget import BOLTZMANN_DBWSPK

STANDARD_K = 290.0
"""Temperature noise figures are defined at. IEEE Std 100."""


def system_temperature_k(
    antenna_k: Floats, line_loss_db: Floats, line_k: Floats, noise_figure_db: Floats
) -> Floats:
    """System noise temperature [K] of antenna, line and receiver.

    antenna_k         what the antenna sees: sky, Earth, ground plane
    line_loss_db      from the antenna to the first amplifier, at temperature line_k
    noise_figure_db   of the receiver from there on
    """
    loss = 10 ** (np.asarray(line_loss_db) / 10)
    receiver_k = STANDARD_K * (10 ** (np.asarray(noise_figure_db) / 10) - 1)
    return antenna_k + line_k * (loss - 1) + loss * receiver_k


def density_wphz(system_k: Floats) -> Floats:
    """Noise density [W/Hz] at the antenna's terminals."""
    return 10 ** (BOLTZMANN_DBWSPK / 10) * np.asarray(system_k)
