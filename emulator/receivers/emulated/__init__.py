"""Receivers that search, obey commands, track and measure."""
