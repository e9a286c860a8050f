"""Arguments that several commands share, checked as they are read: one line says what is allowed."""

from __future__ import annotations

import argparse
from pathlib import Path

from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.process.command_line import Value, option_value, seconds
from gnss_hil.tools.run_config.config import Overrides

DEFAULT_SCENARIO = "soyuz"


def pace(text: str) -> str:
    from gnss_hil.dbc.lockstep.master_loop import parse_pace

    try:
        parse_pace(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def bus(text: str) -> str:
    """'embedded', 'inline', or INTERFACE:CHANNEL."""
    interface, colon, channel = text.partition(":")
    alone = ("embedded", "inline", "python-can")
    if (interface in alone and not colon) or (interface and channel and interface != "inline"):
        return text
    from gnss_hil.dbc.bus.open_link import probably

    meant = hint(text, alone) or (f"; {probably(text)}" if interface and not colon else "")
    raise argparse.ArgumentTypeError(
        f"'{text}': not one of {', '.join(alone)}, socketcan:IFACE, INTERFACE:CHANNEL{meant}"
    )


def seed(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) >= 2**63:
        raise argparse.ArgumentTypeError(f"'{text}': a whole number from 0 to 2^63 - 1")
    return int(text)


_MOST_SEEDS = 10_000


def seeds(text: str) -> tuple[int, ...]:
    """'1:20', both included; '1:20:5' every fifth; '3,5,8'."""
    parts = text.split(",") if "," in text else text.split(":")
    if not all(part.isascii() and part.isdigit() for part in parts) or ("," not in text and len(parts) > 3):
        raise argparse.ArgumentTypeError(f"'{text}': FIRST:LAST, FIRST:LAST:STEP, or A,B,C of whole numbers")
    numbers = [seed(part) for part in parts]
    if "," not in text and len(parts) > 1:
        first, last, step = (*numbers, 1)[:3]
        if last < first or step < 1:
            raise argparse.ArgumentTypeError(f"'{text}': no seed is in it")
        numbers = range(first, last + 1, step)
    if len(numbers) > _MOST_SEEDS:
        raise argparse.ArgumentTypeError(f"'{text}': {len(numbers)} seeds; {_MOST_SEEDS} at most")
    if len(set(numbers)) < len(numbers):
        raise argparse.ArgumentTypeError(f"'{text}': a seed twice")
    return tuple(numbers)


def option(text: str) -> tuple[str, Value]:
    """'hysteresis_deg=2', 'overflow=next', 'flag=true'."""
    key, equals, value = text.partition("=")
    if not (key and equals and value):
        raise argparse.ArgumentTypeError(f"'{text}': not of the form KEY=VALUE")
    return key, option_value(value)


def add_scenario(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scenario", nargs="?", default=DEFAULT_SCENARIO, metavar="SCENARIO",
        help=f"shipped scenario or a .toml file (default {DEFAULT_SCENARIO}; see gnss-hil scenarios)",
    )  # fmt: skip


def setting(text: str) -> tuple[str, str]:
    """'craft.0.orbit.altitude_km=500': path and value."""
    key, equals, value = text.partition("=")
    if not (key.strip() and equals and value.strip()):
        raise argparse.ArgumentTypeError(f"'{text}': not of the form KEY=VALUE")
    return key.strip(), value.strip()


def add_changes(parser: argparse.ArgumentParser) -> None:
    """What a command line may change of a scenario."""
    add_truth_changes(parser)
    _add_flight_changes(parser)


def _add_flight_changes(parser: argparse.ArgumentParser) -> None:
    """What it may change of the flight software."""
    from gnss_hil.flightsw.assignment.registry import POLICIES
    from gnss_hil.flightsw.estimation.registry import NAVIGATORS

    add = parser.add_argument
    add("--policy", metavar="P", help=f"assignment policy of the flight software: {', '.join(POLICIES)}")
    add(
        "--navigator",
        metavar="N",
        help=f"how a fix is made, if not as the policy has it: {', '.join(NAVIGATORS)}",
    )
    add(
        "--option", action="append", type=option, default=[], metavar="K=V",
        help="option of the flight software: of its policy, its navigator or any flight; repeatable",
    )  # fmt: skip


def add_truth_changes(parser: argparse.ArgumentParser) -> None:
    """What it may change of the emulator's side."""
    from gnss_hil.emulator.error_models.registry import FACTORS
    from gnss_hil.emulator.receivers.emulated.search import RULES

    add = parser.add_argument
    add("--duration", type=seconds, metavar="S", help="simulated time: seconds, or 10m, 24h, 1d")
    add("--interval", type=seconds, metavar="S", help="time between epochs: seconds, or 100ms")
    add("--seed", type=seed, metavar="N", help="seed of all random draws")
    add(
        "--nav", action="append", type=Path, default=[], metavar="FILE",
        help="broadcast navigation file (RINEX 2 or 3, .gz accepted), repeatable; together they are the sky",
    )  # fmt: skip
    add(
        "--sp3", action="append", type=Path, default=[], metavar="FILE",
        help="precise orbits and clocks, repeatable: flown while the satellites report what --nav or the "
        "scenario says; in a replay what they report, with --nav's group delays",
    )  # fmt: skip
    add(
        "--obs", type=Path, metavar="FILE",
        help="observations of a real receiver (RINEX 2 or 3, compact or gzip too) for the scenario 'replay'",
    )  # fmt: skip
    add(
        "--reference", type=Path, metavar="FILE",
        help="the craft's known orbit, CCSDS OEM, in a replay or with --emulator: what fixes are judged by",
    )  # fmt: skip
    add(
        "--ionosphere-free", action="store_true",
        help="fixes from both frequencies of each satellite; emulated receivers need a vehicle that has them",
    )  # fmt: skip
    add("--vehicle", metavar="FILE", help="vehicle file, or name of a shipped one, instead of the scenario's")
    add(
        "--set", action="append", type=setting, default=[], metavar="K=V",
        help="any key of the scenario by its path, repeatable: craft.0.orbit.altitude_km=500, "
        "sky.gps='[\"a.nav\"]', craft.0.factors.code_noise=false",
    )  # fmt: skip
    add(
        "--autonomous",
        choices=RULES,
        metavar="RULE",
        help=f"receivers left alone search by: {', '.join(RULES)}",
    )
    add(
        "--fault", action="append", default=[], metavar="TEXT",
        help="a fault on the bus, in one line, repeatable: \"rx2 off @2m+30s\" (gnss-hil faults)",
    )  # fmt: skip
    add(
        "--faults", action="append", type=Path, default=[], metavar="FILE",
        help="faults of a file, or of a shipped one by name, repeatable (gnss-hil faults list)",
    )  # fmt: skip
    for way in ("on", "off"):
        add(
            f"--{way}", action="append", default=[], choices=[*FACTORS, "all"], metavar="FACTOR",
            help=f"switch an error factor {way}; repeatable: {', '.join(FACTORS)}; or all but what needs "
            "parameters (jamming). A name counts more than all",
        )  # fmt: skip


def overrides_of(a: argparse.Namespace) -> Overrides:
    """What arguments of `add_changes`, or of `add_truth_changes` alone, change of a scenario."""
    return Overrides(
        duration_s=a.duration, interval_s=a.interval, seed=a.seed, nav=tuple(a.nav), sp3=tuple(a.sp3),
        obs=a.obs, reference=a.reference, ionosphere_free=a.ionosphere_free, vehicle=a.vehicle,
        policy=getattr(a, "policy", None), navigator=getattr(a, "navigator", None),
        options=tuple(getattr(a, "option", ())), autonomous=a.autonomous, sets=tuple(a.set),
        on=tuple(a.on), off=tuple(a.off), fault_files=tuple(a.faults), faults=tuple(a.fault),
    )  # fmt: skip
