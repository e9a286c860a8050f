"""All kinds of faults, by name: the only list. A row's module has parameters, what it does, an example."""

from __future__ import annotations

from collections.abc import Container, Mapping

from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.faults.kinds import commands, content, inside, marks, nodes, receivers, sky, traffic
from gnss_hil.emulator.faults.kinds.row import Row

GROUPS: Mapping[str, tuple[Row, ...]] = {
    "frames on their way": traffic.ROWS,
    "what frames carry": content.ROWS,
    "time": marks.ROWS,
    "commands": commands.ROWS,
    "nodes": nodes.ROWS,
    "receivers": receivers.ROWS,
    "satellites and oscillators": sky.ROWS,
    "inside the emulator": inside.ROWS,
}

KINDS: Mapping[str, Row] = table(*(row for rows in GROUPS.values() for row in rows))


def called(word: str, place: Container[str]) -> Row | None:
    """The kind that a one-liner means by a word; of several with the word the one that a place with these
    keys is of."""
    if word in KINDS:
        return KINDS[word]
    rows = [row for row in KINDS.values() if word in row.words]
    fitting = [row for row in rows if row.of and row.of in place]
    return next(iter([*fitting, *(row for row in rows if not row.of), *rows]), None)


WORDS = tuple(dict.fromkeys([*KINDS, *(word for row in KINDS.values() for word in row.words)]))
"""Every word for a kind."""
