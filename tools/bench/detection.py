"""Which check saw something, and after how many epochs of a fault."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

import polars as pl

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.common.near import did_you_mean, nearest
from gnss_hil.dbc.common.systems import by_letter
from gnss_hil.dbc.contract.messages import messages, node_names
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.tools.bench.errors import BenchError
from gnss_hil.tools.results.checks import BENCH, CHECKS
from gnss_hil.tools.results.detectors import ROWS


def named(check: str) -> tuple[str, ...]:
    """A check by the names that tables have, or those that a word of `detected_by` means; BenchError if there
    is none."""
    name = check.strip().upper().replace("-", "_").replace(" ", "_")
    meant = ROWS.get(name.lower().replace("_", "-"), ())
    if name in CHECKS or name.startswith("UNKNOWN_"):
        return (name, *meant)
    if meant:
        return meant
    known = [label.lower() for label in CHECKS]
    raise BenchError(f"check '{check}': not known; {did_you_mean(check, known, 'there are')}")


def seen(
    checks: pl.DataFrame, check: str, where: str | None = None, antennas: Iterable[Sequence[str]] = ()
) -> pl.DataFrame:
    """The rows of a check, of a message, node, antenna or satellite, or of any: "RX2" is the node and its
    messages "RX2_...". BenchError if there is no such check or place.

    antennas   their names, of each craft
    """
    found = checks.filter(pl.col("check").is_in(named(check)))
    if where is None:
        return found
    name = place(where, list(antennas))
    return found.filter((pl.col("where") == name) | pl.col("where").str.starts_with(f"{name}_"))


def place(where: str, antennas: Sequence[Sequence[str]]) -> str:
    """A place as tables have it; BenchError if it is none of a run whose craft have these antennas."""
    name = where.strip().upper()
    called = {
        f"RX{number}" for names in antennas for number, one in enumerate(names, 1) if one.upper() == name
    }
    if len(called) > 1:
        raise BenchError(f"where='{where}': {' and '.join(sorted(called))}; which craft? of(craft) has one")
    if called:
        return called.pop()
    receivers = max(map(len, antennas), default=MAX_RECEIVERS)
    known = [*node_names(receivers), *(one.name for one in messages(receivers)), BENCH]
    if name in known or any(one.startswith(f"{name}_") for one in known):
        return name
    if _IDENTIFIER.fullmatch(where.strip()):
        return f"0x{name[2:]}"
    if _is_satellite(name):
        return name
    words = [*known, *(one for names in antennas for one in names)]
    near = nearest(where, words)
    meant = (
        f"did you mean '{near}'?"
        if near
        else (
            f"there are receivers (RX1 to RX{receivers}), antennas by name, nodes (ATT), "
            "messages (RX1_RANGE), satellites (G07), identifiers (0x3A5)"
        )
    )
    raise BenchError(f"where='{where}': no such place; {meant}")


def _is_satellite(name: str) -> bool:
    match = _SATELLITE.fullmatch(name)
    system = match and by_letter(match[1])
    return bool(match and system and 1 <= int(match[2]) <= system.numbers)


_SATELLITE, _IDENTIFIER = re.compile(r"([A-Z])(\d\d)"), re.compile(r"0[xX][0-9a-fA-F]{1,8}")


def first_epochs(faults: pl.DataFrame, fault: str | None) -> Mapping[str, int]:
    """First epoch in which a fault touched a frame, or of its window where it acts elsewhere, by craft; None:
    the only one. BenchError if there is no such one, or if it never acted: a window in which none of its
    frames came is none in which it did."""
    known = faults["fault"].unique(maintain_order=True).to_list()
    if fault is None and len(known) > 1:
        raise BenchError(f"fault=: which of {len(known)}? {', '.join(map(repr, known))}")
    if fault is not None and fault not in known:
        raise BenchError(f"fault '{fault}': never acted in this run; {_acted(fault, known)}")
    if not known:
        raise BenchError("within=: counts from a fault, and none acted in this run")
    mine = faults.filter(pl.col("active"), fault=fault or known[0])
    elsewhere = [kind for kind, row in KINDS.items() if not row.frames]
    begun = pl.when(pl.col("kind").is_in(elsewhere)).then("first_epoch").otherwise("first_struck")
    acted = mine.with_columns(begun=begun).drop_nulls("begun")
    if acted.is_empty():
        raise BenchError(
            f"fault '{fault or known[0]}': never acted in this run; no frame was at its place then"
        )
    return dict(acted.group_by("craft").agg(pl.col("begun").min()).iter_rows())


def _acted(fault: str, known: list[str]) -> str:
    return did_you_mean(fault, known, "those that did are") if known else "none did"


def late(rows: pl.DataFrame, first: Mapping[str, int]) -> list[int]:
    """Epochs from a fault's first one on its craft, which is 0, to those of rows that are not before it."""
    crafts = pl.DataFrame({"craft": list(first), "first": list(first.values())}, schema={**_FIRST})
    behind = rows.join(crafts, on="craft").select(pl.col("epoch") - pl.col("first")).to_series()
    return sorted(set(behind.filter(behind >= 0).to_list()))


_FIRST = {"craft": pl.String, "first": pl.Int64}
