"""Real receivers played: observations of a RINEX file become frames, as if they had been emulated.

signals   which observation codes make up a signal of the contract
tracks    observations of a file as rows of channels: ranges, rates, phases, slips, C/N0
craft     what does not change of a craft that is played, and its step
"""
