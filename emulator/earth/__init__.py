"""The Earth, Sun and Moon: constants, frames, gravity, atmosphere."""
