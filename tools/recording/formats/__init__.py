"""Recordings of a bus as files."""
