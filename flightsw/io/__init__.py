"""Frames in, frames out: decoding, encoding, which nodes are heard, what was refused."""
