"""How much there can be of what vehicle files describe and frames number."""

MAX_RECEIVERS = 8
CHANNELS = 32
"""Channels of a receiver."""
