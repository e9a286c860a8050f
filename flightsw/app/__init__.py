"""One epoch of the flight software, from frames to frames."""
