"""Attitude of the body, from the attitude unit's reports."""
