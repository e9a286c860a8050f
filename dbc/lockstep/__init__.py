"""Epoch by epoch over a bus: the time master and its slaves, with and without I/O."""
