"""A word that is not known, and the known one that was probably meant."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that looks most like this one, or alone begins with it, in any case of letters; None if
    none does."""
    from difflib import get_close_matches

    by_lower = {name.lower(): name for name in known}
    found = get_close_matches(word.lower(), by_lower, 1)
    if not found and len(word) >= _TOLD_BY:
        found = [name for name in by_lower if name.startswith(word.lower())]
        found = found if len(found) == 1 else []
    return by_lower[found[0]] if found else None


_TOLD_BY = 3
"""So many letters tell a word that they alone begin."""


def hint(word: str, known: Iterable[str]) -> str:
    """ "; did you mean 'WORD'?", to be said behind all there are; nothing if no known word is near."""
    near = nearest(word, known)
    return f"; did you mean '{near}'?" if near else ""


def did_you_mean(word: str, known: Iterable[str], otherwise: str = "allowed are") -> str:
    """What to say of a word that is not known: the nearest, or all there are."""
    known = list(known)
    near = nearest(word, known)
    return f"did you mean '{near}'?" if near else f"{otherwise} {', '.join(known)}"
