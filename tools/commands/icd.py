"""`gnss-hil icd`: the bus contract, for those who implement the other end."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.common.places import check_new_file
from gnss_hil.tools.common.whole_file import draft_of

PARTS = ("html", "dbc", "hash", "budget")
DEFAULT_FILE = "gnss-hil-icd.html"
DEFAULT_SCENARIO = "soyuz"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "part",
        nargs="?",
        metavar="PART",
        help="html: the interface control document, one page; dbc: the DBC file; hash: its contract hash; "
        "budget: frames and load",
    )
    add("scenario", nargs="?", metavar="SCENARIO", help="of the frame budget (default soyuz)")
    add("--html", action="store_true", help="the same as the part html")
    add(
        "--receivers",
        type=_receivers,
        metavar="N",
        help="receivers on the bus, 1 to 8 (default 4, for html those of the scenario)",
    )
    add(
        "--per-channel", action="store_true",
        help="dbc: multiplexed by channel, so that programs plot each channel by itself; the hash stays that "
        "of the plain file",
    )  # fmt: skip
    add(
        "--out",
        type=Path,
        metavar="FILE",
        help=f"where html goes (default {DEFAULT_FILE} on a terminal, else standard output)",
    )
    add("--force", action="store_true", help="overwrite FILE")


def _receivers(text: str) -> int:
    if text not in "12345678" or len(text) != 1:
        raise argparse.ArgumentTypeError(f"{text} receivers; a contract has 1 to 8")
    return int(text)


def run(arguments: Namespace) -> int:
    part, scenario = _asked(arguments)
    if scenario and part not in ("budget", "html"):
        raise Mistake(f"icd {part} takes no scenario, found '{scenario}'")
    if arguments.receivers and part == "budget":
        raise Mistake("icd budget takes its receivers from the scenario's vehicle, not from --receivers")
    if arguments.per_channel and part != "dbc":
        raise Mistake(f"icd {part}: --per-channel is for dbc")
    if arguments.out and part != "html":
        raise Mistake(f"icd {part} writes to standard output; --out is for html")
    if part == "html":
        _write_html(scenario, arguments.receivers, arguments.out, arguments.force)
    elif part == "budget":
        _print_budget(scenario or DEFAULT_SCENARIO)
    else:
        from gnss_hil.dbc.contract.codec import codec

        contract = codec(arguments.receivers or 4)
        if arguments.per_channel:
            from gnss_hil.dbc.contract.generate import dbc_text

            sys.stdout.write(dbc_text(arguments.receivers or 4, per_channel=True))
        else:
            sys.stdout.write(contract.text if part == "dbc" else f"{contract.hash:08x}\n")
    return 0


def _asked(arguments: Namespace) -> tuple[str, str | None]:
    """Part and scenario; with --html the first word is the scenario."""
    part, scenario = arguments.part, arguments.scenario
    if arguments.html and part not in PARTS:
        if scenario:
            raise Mistake(f"icd --html takes one scenario, found '{part}' and '{scenario}'")
        return "html", part
    if arguments.html and part != "html":
        raise Mistake(f"icd {part} and --html: one of the two")
    if part is None:
        raise Mistake(f"icd: a part is missing; allowed are {', '.join(PARTS)} (see gnss-hil icd --help)")
    if part not in PARTS:
        raise Mistake(f"icd: no part '{part}'; allowed are {', '.join(PARTS)}")
    return part, scenario


def _write_html(scenario: str | None, receivers: int | None, out: Path | None, force: bool) -> None:
    from gnss_hil.tools.icd.documented_buses import subject
    from gnss_hil.tools.icd.page import document

    if out is None and not sys.stdout.isatty():
        sys.stdout.write(document(subject(scenario, receivers)))
        return
    path = out or Path(DEFAULT_FILE)
    check_new_file(path, force, f"--out {out}" if out else None)
    page = document(subject(scenario, receivers))
    with draft_of(path) as draft:
        draft.write_text(page, "utf-8")
    print(f"interface control document: {path}")


def _print_budget(name: str) -> None:
    from gnss_hil.tools.run_config.plan import make

    plan = make(name, refuse_overload=False)
    for craft, vehicle, budget in zip(plan.names, plan.vehicles, plan.budgets, strict=True):
        print(f"Craft {craft}, vehicle {vehicle.name}:\n")
        print(budget.table())
