"""`gnss-hil faults`: the kinds of faults there are, one of them in full, and fault files checked."""

from __future__ import annotations

import argparse
from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.common.errors import Mistake

PARTS = ("list", "show", "check")
DEFAULT_SCENARIO = "soyuz"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("part", nargs="?", default="list", metavar="PART", choices=PARTS,
        help="list (default): kinds of faults; show KIND: its parameters and an example; check FILE ...: "
        "fault files, or lines in quotes, against a scenario")  # fmt: skip
    add(
        "what",
        nargs="*",
        metavar="KIND|FILE|TEXT",
        help="a kind; fault files, shipped ones by name, or lines",
    )
    add("--scenario", default=DEFAULT_SCENARIO, metavar="S",
        help="whose craft and signals they are checked against (default soyuz)")  # fmt: skip


def run(arguments: Namespace) -> int:
    return _PARTS[arguments.part](arguments)


def _list(arguments: Namespace) -> int:
    if arguments.what:
        raise Mistake(f"faults list takes nothing, found '{arguments.what[0]}'; faults show KIND")
    from gnss_hil.emulator.faults.kinds.registry import GROUPS, KINDS

    width = max(map(len, KINDS))
    for group, rows in GROUPS.items():
        print(f"{group}:")
        for row in rows:
            print(f"  {row.name:<{width}}  {row.summary}")
    return 0


def _show(arguments: Namespace) -> int:
    from gnss_hil.dbc.common.near import did_you_mean
    from gnss_hil.emulator.faults.kinds.registry import KINDS
    from gnss_hil.tools.schema.fault_page import described

    if not arguments.what:
        raise Mistake("faults show: which kind? gnss-hil faults list")
    for name in arguments.what:
        if name not in KINDS:
            raise Mistake(f"faults show: no kind '{name}'; {did_you_mean(name, KINDS)}")
    print("\n\n".join(described(KINDS[name]) for name in arguments.what))
    return 0


def _check(arguments: Namespace) -> int:
    """Every mistake of all of them; exit status 2 if there is one."""
    if not arguments.what:
        raise Mistake("faults check: which file, or line?")
    from gnss_hil.emulator.faults import files
    from gnss_hil.emulator.faults.models import FaultError

    wrong: list[str] = []
    good: list[tuple[str, int]] = []
    files.check_quoted(arguments.what)
    plan = _scene(arguments.scenario)
    for text in arguments.what:
        try:
            name, found, origins = _read(text, files)
            plan(found, origins)
            good.append((name, len(found)))
        except FaultError as error:
            wrong.append(str(error))
    if wrong:
        raise Mistake("\n".join(wrong))
    for name, count in good:
        print(f"{name}: {so_many(count, 'fault')}, no mistake")
    return 0


def _read(text: str, files):
    """Name, faults and where each is from, of a file, a shipped one, or a line."""
    if files.is_line(text):
        return f"'{text}'", (files.of_line(text),), [f"--fault '{text}'"]
    path = files.FILES.find(text)
    found = files.load(path).fault
    return str(path), found, [f"{path}: fault.{n}" for n in range(len(found))]


def _scene(scenario: str):
    """What arms faults on the craft of a scenario."""
    from gnss_hil.dbc.contract.codec import codec
    from gnss_hil.emulator.faults import engine
    from gnss_hil.emulator.faults.models import FaultError
    from gnss_hil.tools.run_config import plan

    found = plan.resolve(scenario)
    names = [craft.name for craft in found.scenario.craft]
    sky = _sky(found.scenario.sky.sources())

    def armed(faults, origins) -> None:
        wrong = [
            f"{origin}: craft: no craft '{one.craft}'; {', '.join(names)}"
            for one, origin in zip(faults, origins, strict=True)
            if one.craft is not None and one.craft not in names
        ]
        for name, vehicle in zip(names, found.vehicles, strict=True):
            interval_ns, seed = found.scenario.time.interval_ns, found.scenario.seed
            bus = (name, vehicle, codec(vehicle.antennas), interval_ns, seed)
            wrong += engine.arm(faults, *bus, origins=origins, sky=sky)[1]
        if wrong:
            raise FaultError("\n".join(dict.fromkeys(wrong)))

    return armed


def _sky(sources: Mapping[str, Any]):
    """(SATELLITES,) the satellites of the systems that there are, by their sources."""
    import numpy as np

    from gnss_hil.dbc.common import satellites
    from gnss_hil.dbc.common.systems import SYSTEMS

    numbers = {name: np.arange(1, SYSTEMS[name].numbers + 1) for name, of in sources.items() if of != "none"}
    there = np.zeros(satellites.SATELLITES, bool)
    for name, some in numbers.items():
        there[satellites.index(SYSTEMS[name].value, some)] = True
    return there


_PARTS = {"list": _list, "show": _show, "check": _check}
