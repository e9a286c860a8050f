"""Clocks on board: receivers' oscillators, the computer's clock, when receivers latch."""
