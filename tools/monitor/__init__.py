"""Listening on a bus and decoding what is heard, live."""
