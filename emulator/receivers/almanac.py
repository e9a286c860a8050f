"""Almanac predictions on the bus: a slice of the sky each epoch.

The unit's almanac is one. Its receivers deal the satellites out among themselves, one place further in
every pass, so that each satellite passes once a cycle and each receiver sends all of them in turn.
Predictions are the truth as coarse as the message (250 m, 1 m/s) and never old, age 0 h (modelled: a real
almanac is off by kilometres, which no choice of satellites notices). Cold receivers have it too.
"""

from __future__ import annotations

from emulator.receivers.channels import Flags, Numbers


def portion(available: Flags, epoch: int, epochs_per_pass: int, receivers: int) -> tuple[Numbers, Numbers]:
    """Rows of the sky that are sent in this epoch, and which receiver (0-based) sends each.

    available        (n,) satellites in the almanac
    epochs_per_pass  epochs in which all n rows pass once
    """
    number, part = divmod(epoch, epochs_per_pass)
    n = len(available)
    first, end = part * n // epochs_per_pass, (part + 1) * n // epochs_per_pass
    rows = first + available[first:end].nonzero()[0]
    return rows, (rows + number) % receivers
