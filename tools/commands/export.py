"""`gnss-hil export`: what a run measured, as files that other software reads."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from collections.abc import Iterable
from pathlib import Path

from gnss_hil.tools.common.errors import PROGRAM, Mistake
from gnss_hil.tools.common.places import check_folder, check_new_files, make_folder

FOLDER = "export"
SKY_FOLDER = "sky"
"""Apart from the messages of rinex, which have the same name and are in WGS-84."""

KINDS = ("rinex", "oem", "sp3", "sky")
_OPTIONS_OF = {"shapiro": "rinex", "pz90": "rinex", "no_navigation": "rinex"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "kind", choices=KINDS, metavar="|".join(KINDS),
        help="rinex: observations of each antenna and of the centre of mass, and the satellites' messages; "
        "oem: CCSDS orbit ephemeris messages; sp3: orbits of the craft; "
        "sky: messages and orbits of nominal satellites, as --nav and --sp3 take them",
    )  # fmt: skip
    add("run", type=Path, metavar="RUN", help="run folder with its bus.log")
    add(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"folder for the files (default RUN/{FOLDER}; of sky RUN/{SKY_FOLDER})",
    )
    add("--truth", action="store_true", help="oem, sp3: where the craft really was, instead of its fixes")
    add(
        "--shapiro", action="store_true",
        help="rinex: leave the relativistic path delay in the ranges of the centre of mass; without, it is "
        "taken out for single-point programs, which know none",
    )  # fmt: skip
    add(
        "--pz90", action="store_true",
        help="rinex: GLONASS messages in PZ-90 as of their date; without in WGS-84, as on the bus",
    )  # fmt: skip
    add("--force", action="store_true", help="overwrite files of an earlier export")
    add("--no-navigation", action="store_true", help="rinex: observation files only")


def run(arguments: Namespace) -> int:
    kind, folder = arguments.kind, arguments.run
    _check(arguments)
    from gnss_hil.tools.export import run_data
    from gnss_hil.tools.results import assemble

    remarks: list[str] = []
    if kind == "sky":
        from gnss_hil.tools.export import sky

        files = sky.files_of(run_data.scenario_of(folder))
    elif kind == "rinex":
        from gnss_hil.tools.export.rinex import Choices, files_of

        scenario, craft = run_data.read(folder)

        choices = Choices(arguments.shapiro, not arguments.pz90, not arguments.no_navigation)
        files, remarks = files_of(scenario, craft, choices)
    else:
        from gnss_hil.tools.export import orbit_files

        scenario, craft = run_data.read(folder)
        files = orbit_files.files_of(kind, folder, scenario.name, craft, arguments.truth)
    out = arguments.out or folder / (SKY_FOLDER if kind == "sky" else FOLDER)
    check_new_files((out / file.name for file in files), arguments.force)
    make_folder(out)
    for file in files:
        _write(out / file.name, file.text)
        print(f"{out / file.name}{': ' if file.remark else ''}{file.remark}")
    for line in (*assemble.since_the_run(folder), *remarks):
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return 0


def _check(arguments: Namespace) -> None:
    for option, kind in _OPTIONS_OF.items():
        if getattr(arguments, option) and arguments.kind != kind:
            raise Mistake(f"--{option.replace('_', '-')} belongs to export {kind}")
    if arguments.truth and arguments.kind not in ("oem", "sp3"):
        raise Mistake("--truth belongs to export oem and sp3: nothing observes the truth")
    if arguments.out:
        check_folder(arguments.out)


def _write(path: Path, text: Iterable[str]) -> None:
    """A file that is there whole or not at all."""
    from gnss_hil.tools.common.whole_file import draft_of

    with draft_of(path) as draft, draft.open("w", encoding="ascii", newline="\n") as stream:
        stream.writelines(text)
