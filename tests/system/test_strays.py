"""One stray frame on the bus of a whole run: the record is the flight, or the exit status is not 0.

A choice of `python -m tests.support.strays`, which plays all.
"""

from __future__ import annotations

import pytest

from tests.support.strays import run

pytestmark = [
    pytest.mark.verifies(what="Record: whether it is the flight"),
    pytest.mark.slow(seconds=4),
]


@pytest.mark.parametrize(
    ("kind", "moment", "words"),
    [
        ("end-other-session", "amid", "1 bench frames refused: 1 of another session"),
        ("end-empty", "start", "1 bench frames refused: 1 wrong length"),
        ("done-last", "near-end", "1 bench frames refused: 1 of another epoch"),
        ("uds-response", "amid", ""),
        ("mark-other-session", "before", "1 time mark left out of the record"),
    ],
)
def test_what_is_refused_is_told_and_changes_nothing(kind, moment, words):
    result = run(kind, moment, "lockstep")
    assert result.honest and result.status == 0
    assert words in result.words


@pytest.mark.parametrize("pace", ["lockstep", "x50"])
@pytest.mark.parametrize(
    ("kind", "moment"), [("mark-4096", "amid"), ("mark-next", "start"), ("position-forged", "amid")]
)
def test_what_may_be_believed_is_no_status_0(kind, moment, pace):
    result = run(kind, moment, pace)
    assert result.status == 1 and "several peers of the bus spoke by turns" in result.words
