"""`gnss-hil scenarios`: what ships with the bench."""

from __future__ import annotations

import argparse
from argparse import Namespace
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--path", action="store_true", help="print where the files are, to copy and change them"
    )


def run(arguments: Namespace) -> int:
    from gnss_hil.emulator.config.scenario import shipped

    files = shipped()
    width = max(map(len, files))
    for name, path in files.items():
        print(f"{name:<{width}}  {path if arguments.path else _description(path)}")
    return 0


def _description(path: Path) -> str:
    from gnss_hil.emulator.config.scenario import parse, read

    scenario = parse(read(path), str(path))
    return f"{scenario.description} ({scenario.time.duration_s:g} s)"
