"""`gnss-hil icd`: the bus contract, for those who implement the other end."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace

from tools.errors import Mistake

PARTS = ("dbc", "hash", "budget")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "part",
        choices=PARTS,
        metavar="PART",
        help="dbc: the DBC file; hash: its contract hash; budget: frames and load",
    )
    add("scenario", nargs="?", metavar="SCENARIO", help="of the budget (default soyuz)")
    add("--receivers", type=_receivers, metavar="N", help="receivers on the bus, 1 to 8 (default 4)")


def _receivers(text: str) -> int:
    if text not in "12345678" or len(text) != 1:
        raise argparse.ArgumentTypeError(f"{text} receivers; a contract has 1 to 8")
    return int(text)


def run(arguments: Namespace) -> int:
    if arguments.scenario and arguments.part != "budget":
        raise Mistake(f"icd {arguments.part} takes no scenario, found '{arguments.scenario}'")
    if arguments.receivers and arguments.part == "budget":
        raise Mistake("icd budget takes its receivers from the scenario's vehicle, not from --receivers")
    receivers = arguments.receivers or 4
    if arguments.part == "dbc":
        from dbc.codec import codec

        sys.stdout.write(codec(receivers).text)
    elif arguments.part == "hash":
        from dbc.codec import codec

        print(f"{codec(receivers).hash:08x}")
    else:
        _print_budget(arguments.scenario or "soyuz")
    return 0


def _print_budget(name: str) -> None:
    from tools.arguments import unchanged
    from tools.plan import make

    plan = make(unchanged(name), refuse_overload=False)
    for craft, vehicle, budget in zip(plan.names, plan.vehicles, plan.budgets, strict=True):
        print(f"Craft {craft}, vehicle {vehicle.name}:\n")
        print(budget.table())
