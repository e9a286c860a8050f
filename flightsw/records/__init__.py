"""Records that the stages of an epoch hand to each other: arrays in frozen dataclasses."""
