"""Receivers: emulated ones, and recorded ones that are played; the frames of both."""
