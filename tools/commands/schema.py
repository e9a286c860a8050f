"""`gnss-hil schema`: JSON schemas of scenario, vehicle, structure and fault files, for editors."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.common.places import check_new_files, make_folder
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
    parser.add_argument("--force", action="store_true", help="overwrite schemas of another version")


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
    wanted = {out / file_name(one): (one, text(one)) for one in ((kind,) if kind else KINDS)}
    check_new_files((path for path, (_, schema) in wanted.items() if _differs(path, schema)), arguments.force)
    make_folder(out)
    for path, (one, schema) in wanted.items():
        with draft_of(path) as draft:
            draft.write_text(schema, "utf-8")
        print(f'{path}: begin a {one} file with "#:schema ./{path.name}"')
    return 0


def _differs(path: Path, schema: str) -> bool:
    """Whether something else than this schema is at `path`."""
    return path.exists() and not (path.is_file() and path.read_bytes() == schema.encode())
