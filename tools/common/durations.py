"""Spans of time as people read them."""

from __future__ import annotations


def clock(seconds: float) -> str:
    """'1 d 02:03:04', '00:10:00'."""
    days, rest = divmod(int(seconds), 86400)
    text = f"{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"
    return f"{days} d {text}" if days else text
