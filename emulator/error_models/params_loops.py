"""Parameters of the loops' thermal noise: none but the loops' own, `emulator.signal.loops`."""

from __future__ import annotations

from gnss_hil.emulator.error_models.params import Factor


class CodeNoise(Factor):
    """Thermal noise of the delay lock loop, non-coherent; no parameters but the loop's."""


class CarrierNoise(Factor):
    """Thermal noise of the phase lock loop, a Costas loop; no parameters but the loop's."""


class DopplerNoise(Factor):
    """Thermal noise of the frequency lock loop; no parameters but the loop's."""
