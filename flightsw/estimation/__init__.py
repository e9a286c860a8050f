"""From measurements to a state: how the measurements of an epoch become a solution."""
