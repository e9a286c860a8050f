"""Signals of any contract: frames decoded by a DBC file, many at a time."""
