"""Faults on the bus: what they are (files and one-liners), and the engine that applies them to frames.

A fault has a kind (`kinds`), a place (`where`), a time (`when`), what it does to signals (`signals`) and to
CRC and counter (`protect`). `engine.inject` is pure: frames and state in, frames and state out, every draw
keyed by the seed. Nothing here knows a bus: the emulator's step, a gateway and tests call the same function.
"""
