"""Frames in, frames out: decoding, encoding, which nodes are alive, what was refused."""
