"""Arithmetic without physics: piecewise polynomials, rotations, keyed random draws."""
