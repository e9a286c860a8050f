"""Epoch by epoch over a bus: the time master and those who follow it, with and without I/O."""
