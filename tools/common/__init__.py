"""Small things that several tools share."""
