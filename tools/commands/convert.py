"""`gnss-hil convert`: a recording in another format, or its signals as a table."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.common.errors import PROGRAM, Mistake
from gnss_hil.tools.common.places import check_new_file

PARQUET = ".parquet"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "input",
        type=Path,
        metavar="IN",
        help="recording: .log (candump), .asc, .blf or .mf4; or a run folder",
    )
    add(
        "output",
        type=Path,
        metavar="OUT",
        help="recording in the format of its suffix; .parquet: its signals",
    )
    add(
        "--dbc",
        type=Path,
        metavar="FILE",
        help="what the signals of .parquet are: a DBC, or what else cantools reads (default: this bench's)",
    )
    add("--message", metavar="NAME", help="only this message, its signals side by side in .parquet")
    add("--force", action="store_true", help="overwrite OUT")
    add("--quiet", action="store_true", help="no progress")


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.recording.formats.recording import Recording
    from gnss_hil.tools.recording.run_folder import LOG, check_run_folder

    source, out = arguments.input, arguments.output
    if not source.exists():
        raise Mistake(f"{source}: no such run folder or recording")
    if source.is_dir():
        check_run_folder(source, (LOG,))
        source /= LOG
    signals = _check_suffix(arguments)
    recording = Recording(source)
    _check_place(source, out, arguments.force)
    done, lines = _signals(arguments, recording) if signals else _recording(arguments, recording)
    if not done.frames and not lines:
        lines = [f"{source}: holds no frames"]
    for line in lines:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return 1 if recording.found.lost or not done.frames else 0


def _check_suffix(arguments: Namespace) -> bool:
    """Whether OUT is to have signals; Mistake if it can be nothing."""
    from gnss_hil.tools.recording.formats.recording import FORMATS, format_of

    out = arguments.output
    if out.suffix.lower() == PARQUET:
        return True
    if out.suffix.lower() not in FORMATS:
        allowed = ", ".join((*FORMATS, PARQUET))
        raise Mistake(f"{out}: suffix '{out.suffix}' is no recording; allowed are {allowed}")
    format_of(out)
    for option in ("dbc", "message"):
        if getattr(arguments, option) is not None:
            raise Mistake(f"--{option}: is for signals; name a {PARQUET} file, not {out}")
    return False


def _check_place(source: Path, out: Path, force: bool) -> None:
    if out.exists() and source.samefile(out):
        raise Mistake(f"{out}: is what would be read; name another file")
    check_new_file(out, force)


@contextmanager
def _counting(out: Path, quiet: bool) -> Iterator[Callable[[int, float | None], None]]:
    """Frames on a terminal while it goes on."""
    from gnss_hil.tools.common.ticker import Ticker
    from gnss_hil.tools.recording.run_folder import naming

    ticker = Ticker("frames", quiet)
    try:
        with naming(out):
            yield ticker.show
    finally:
        ticker.close()


def _recording(arguments: Namespace, recording: Any) -> tuple[Any, list[str]]:
    """Write OUT; what was converted, and what is to be told."""
    from gnss_hil.tools.recording.formats.convert import convert

    with _counting(arguments.output, arguments.quiet) as show:
        done = convert(recording, arguments.output, show)
    print(f"{arguments.output}: {done.summary}")
    return done, done.remarks(recording.path, arguments.output)


def _signals(arguments: Namespace, recording: Any) -> tuple[Any, list[str]]:
    """The same of signals."""
    from gnss_hil.tools.signals.database import load
    from gnss_hil.tools.signals.write import write

    out = arguments.output
    database = _spoken(arguments.input, recording) if arguments.dbc is None else load(arguments.dbc)
    with _counting(out, arguments.quiet) as show:
        done = write(recording, out, database, arguments.message, show)
    print(f"{out}: {so_many(done.rows, 'row')} of {done.read.summary}")
    told = [f"{recording.path}: {line}" for line in done.undecoded.remarks(database)]
    return done.read, done.read.remarks(recording.path, out) + told


def _spoken(source: Path, recording: Any) -> Any:
    """This bench's contract, in a run folder with as many receivers as it has there."""
    from gnss_hil.tools.replay.recorded_run import buses, spoken_contract
    from gnss_hil.tools.signals.database import of_text, shipped

    names = buses(recording) if source.is_dir() else []
    if not names:
        return shipped()
    contract = spoken_contract(recording, names[0])
    return of_text(contract.text, f"the contract with {contract.receivers} receivers")
