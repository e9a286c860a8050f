"""Kinds of faults, a row each: parameters, what it does to frames, which links can do it, an example."""
