"""Satellites from broadcast ephemerides, and ephemerides from satellites."""
