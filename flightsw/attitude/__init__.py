"""Attitude of the body as the bus tells it."""
