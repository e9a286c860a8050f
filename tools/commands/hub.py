"""`gnss-hil hub`: an embedded bus without a run, for programs of one's own."""

from __future__ import annotations

import argparse
from argparse import Namespace
from pathlib import Path

_DESCRIPTION = """\
Serves an embedded bus at PATH, a socket that only you may join (mode 0600), until it is interrupted: what
one peer sends all others receive, in one order. `emulate`, `fly`, `monitor` and `replay` with
`--bus embedded:PATH` and python-can (interface gnss-hil, channel PATH) join it. At the end it removes its
socket, and no other that lies there by then."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", type=Path, metavar="PATH", help="where the socket is to be")
    parser.description = _DESCRIPTION


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.processes.lone_hub import serve

    return serve(arguments.path)
