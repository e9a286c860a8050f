"""From frames to arrays: the one place where the tools read a bus or a recording."""
