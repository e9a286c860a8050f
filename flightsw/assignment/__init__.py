"""Blocks 5 to 9 of RU 2706636 C1: which antenna tracks which satellite, by policy."""
