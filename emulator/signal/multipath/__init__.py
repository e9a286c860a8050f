"""Multipath: reflections from the structure as a channel receives them, and what its loops make of them."""
