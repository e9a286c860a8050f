"""`gnss-hil inject`: a gateway between two buses that lets faults loose on what passes."""

from __future__ import annotations

import argparse
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.command_line import arguments as shared
from gnss_hil.tools.common.errors import PROGRAM, Mistake

DEFAULT_VEHICLE = "soyuz-ms"

_DESCRIPTION = """\
A gateway: what comes on FROM, the emulator's bus, goes to TO, the flight software's, and back, in order,
through the faults. Lockstep works through it. Ends with the run (BENCH_END), at Ctrl-C, or if a bus goes
away. Without faults it changes no byte. Serve embedded buses with `gnss-hil hub`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("faults", nargs="*", metavar="FAULT",
        help="fault files, shipped ones by name, or lines in quotes")  # fmt: skip
    add("--from", dest="source", type=shared.bus, metavar="BUS", help="the emulator's: embedded:PATH, "
        "socketcan:vcan0, any python-can INTERFACE:CHANNEL")  # fmt: skip
    add("--to", dest="sink", type=shared.bus, metavar="BUS", help="the flight software's")
    add("--vehicle", default=DEFAULT_VEHICLE, metavar="FILE",
        help=f"vehicle file, or a shipped one by name (default {DEFAULT_VEHICLE})")  # fmt: skip
    add("--interval", type=shared.seconds, default=1.0, metavar="S",
        help="seconds between epochs (default 1): of windows in seconds")  # fmt: skip
    add("--seed", type=shared.seed, default=0, metavar="N", help="of what faults draw (default 0)")
    add("--craft", default="soyuz", metavar="NAME",
        help="whose bus it is, of faults that name a craft and of draws (default soyuz)")  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="a new folder for what faults did: faults, faults.parquet")
    add("--as-cangw", action="store_true", help="write rules of the kernel's gateway (can-utils) to standard "
        "output instead: between socketcan interfaces, of what cangw can do")  # fmt: skip
    parser.description = _DESCRIPTION


def run(arguments: Namespace) -> int:
    from gnss_hil.dbc.common import vehicle
    from gnss_hil.dbc.contract.codec import codec
    from gnss_hil.emulator.faults import engine
    from gnss_hil.emulator.faults.kinds.row import CANGW, GATEWAY
    from gnss_hil.tools.gateway.session import Gateway, play

    _check(arguments)
    faults, origins, wrong = _faults(arguments.faults)
    flown = vehicle.load(vehicle.find(arguments.vehicle))
    contract = codec(flown.antennas)
    interval_ns = round(arguments.interval * 1e9)
    link = CANGW if arguments.as_cangw else GATEWAY

    def arm(session: int) -> tuple[engine.FaultPlan, list[str]]:
        return engine.arm(
            faults, arguments.craft, flown, contract, interval_ns, arguments.seed, session, link, origins
        )

    plan, cannot = arm(0)
    wrong += cannot
    if arguments.as_cangw:
        from gnss_hil.tools.gateway import cangw

        interfaces = [_interface(arguments.source, "--from"), _interface(arguments.sink, "--to")]
        own = [
            origin
            for one, origin in zip(faults, origins, strict=True)
            if one.craft in (None, arguments.craft)
        ]
        mine = [one for one in faults if one.craft in (None, arguments.craft)]
        _refuse([*wrong, *cangw.refusals(plan, mine, own)])
        print(cangw.script(plan, *interfaces), end="")
        return 0
    _refuse(wrong)
    gateway = Gateway(
        arguments.source, arguments.sink, contract, lambda session: arm(session)[0], arguments.out
    )
    return play(gateway, lambda text: print(f"{PROGRAM}: {text}", flush=True))


def _check(arguments: Namespace) -> None:
    for option, spec in (("--from", arguments.source), ("--to", arguments.sink)):
        if spec is None:
            raise Mistake(f"{option}: none given; {option} embedded:PATH, or INTERFACE:CHANNEL")
        if spec in ("embedded", "inline"):
            raise Mistake(f"{option} {spec}: another process has to be able to join it; embedded:PATH")
    if arguments.source == arguments.sink:
        raise Mistake(f"--to {arguments.sink}: the same bus as --from; a gateway is between two")


def _interface(spec: str, option: str) -> str:
    """The kernel's name of a CAN interface."""
    kind, _, name = spec.partition(":")
    if kind != "socketcan":
        raise Mistake(f"{option} {spec}: cangw is between interfaces of the kernel; socketcan:vcan0")
    return name.partition(",")[0]


def _refuse(wrong: list[str]) -> None:
    """FaultError if there are mistakes, each of them once."""
    from gnss_hil.emulator.faults.models import FaultError

    if wrong:
        raise FaultError("\n".join(dict.fromkeys(wrong)))


def _faults(given: list[str]) -> tuple[list, list[str], list[str]]:
    """Faults of files and lines in their order, where each is from, and mistakes in others."""
    from gnss_hil.emulator.faults import files
    from gnss_hil.emulator.faults.models import FaultError

    found, origins, wrong = [], [], []
    files.check_quoted(given)
    for text in given:
        line = files.is_line(text)
        try:
            some = files.gathered([] if line else [Path(text)], [text] if line else [])
        except FaultError as error:
            wrong += str(error).splitlines()
            continue
        found += some
        origins += [f"--fault '{text}'"] if line else [f"{text}: fault.{n}" for n in range(len(some))]
    return found, origins, wrong
