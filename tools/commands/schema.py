"""`gnss-hil schema`: JSON schemas of scenario, vehicle, structure and fault files, for editors."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.common.whole_file import draft_of

KINDS = ("scenario", "vehicle", "structure", "faults")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "kind",
        nargs="?",
        metavar="KIND",
        help=f"{', '.join(KINDS)}; with --out all of them where none is named",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write KIND.schema.json into a folder, instead of printing it"
    )


def run(arguments: Namespace) -> int:
    kind, out = arguments.kind, arguments.out
    if kind is not None and kind not in KINDS:
        raise Mistake(f"schema: no kind '{kind}'; allowed are {', '.join(KINDS)}")
    from gnss_hil.tools.schema.json_schema import file_name, text

    if out is None:
        if kind is None:
            raise Mistake(f"schema: one of {', '.join(KINDS)} to print, or --out DIR for all of them")
        sys.stdout.write(text(kind))
        return 0
    out.mkdir(parents=True, exist_ok=True)
    for one in (kind,) if kind else KINDS:
        path = out / file_name(one)
        with draft_of(path) as draft:
            draft.write_text(text(one), "utf-8")
        print(f'{path}: begin a {one} file with "#:schema ./{path.name}"')
    return 0
