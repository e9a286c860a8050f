"""Satellites from almanacs."""
