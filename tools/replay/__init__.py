"""A recording played again, one side of it against real software."""
