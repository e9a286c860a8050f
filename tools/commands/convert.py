"""`gnss-hil convert`: a recording in another format."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.common.errors import PROGRAM, Mistake


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "input",
        type=Path,
        metavar="IN",
        help="recording: .log (candump), .asc, .blf or .mf4; or a run folder",
    )
    add("output", type=Path, metavar="OUT", help="recording in the format of its suffix")
    add("--force", action="store_true", help="overwrite OUT")
    add("--quiet", action="store_true", help="no progress")


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.common.ticker import Ticker
    from gnss_hil.tools.recording.formats.convert import convert
    from gnss_hil.tools.recording.formats.recording import Recording, format_of
    from gnss_hil.tools.recording.run_folder import LOG, naming

    source, out = arguments.input, arguments.output
    source = source / LOG if source.is_dir() else source
    format_of(out)
    recording = Recording(source)
    if out.exists() and source.samefile(out):
        raise Mistake(f"{out}: is what would be read; name another file")
    if out.is_dir():
        raise Mistake(f"{out}: is a folder; name a file")
    if out.exists() and not arguments.force:
        raise Mistake(f"{out}: exists; --force overwrites it")
    if not out.absolute().parent.is_dir():
        raise Mistake(f"{out}: no such folder {out.parent}")
    ticker = Ticker("frames", arguments.quiet)
    try:
        with naming(out):
            done = convert(recording, out, ticker.show)
    finally:
        ticker.close()
    print(f"{out}: {done.summary}")
    for line in done.remarks(source, out):
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return 0
