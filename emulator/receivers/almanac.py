"""Almanac predictions on the bus: a slice of the sky each epoch.

The unit's almanac is one; its receivers take turns to send it, a whole pass each. Predictions are the
truth as coarse as the message (250 m, 1 m/s) and never old (modelled: a real almanac is off by kilometres,
which no choice of satellites notices).
"""

from __future__ import annotations

import numpy as np

from emulator.receivers.channels import Flags, Numbers


def portion(available: Flags, epoch: int, epochs_per_pass: int, receivers: int) -> tuple[int, Numbers]:
    """Which receiver sends in this epoch (0-based), and which rows of the sky.

    available        (n,) satellites in the almanac
    epochs_per_pass  epochs in which all n rows pass once
    """
    number, part = divmod(epoch, epochs_per_pass)
    n = len(available)
    first, end = part * n // epochs_per_pass, (part + 1) * n // epochs_per_pass
    return number % receivers, first + np.flatnonzero(available[first:end])
