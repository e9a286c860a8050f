"""What the process shells share: how they read arguments, find their bus, fail and end.

Nothing heavy is imported here: a shell listens to signals before its slow imports.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable
from contextlib import suppress

from gnss_hil.dbc.process.shutdown import Stop


class Mistake(Exception):
    """Arguments or files that cannot be used; one line a fault, for people."""


class Broken(Exception):
    """The run cannot go on; one line for people."""


class Parser(argparse.ArgumentParser):
    """argparse whose errors are one line."""

    def error(self, message: str):
        self.exit(2, f"{self.prog}: {message} (see --help)\n")


def parser_of(program: str, description: str, examples: str) -> Parser:
    return Parser(
        prog=program,
        description=description,
        epilog=examples,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


Value = bool | int | float | str
"""Of an option."""


def option_value(text: str) -> Value:
    """What the text of an option means, as in a TOML file: true and false, whole numbers, numbers; else it is
    itself."""
    if text in ("true", "false"):
        return text == "true"
    for number in (int, float):
        with suppress(ValueError):
            return number(text)
    return text


SHORTEST_S, LONGEST_S = 1e-3, 366 * 86400.0
"""What a duration on a command line may be."""


def seconds(text: str) -> float:
    """A positive duration. '600', '600s', '10ms', '10m', '24h', '1d'."""
    units = {"ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
    unit = next((unit for unit in units if text.endswith(unit)), "")
    number = text.removesuffix(unit)
    try:
        if not number.isascii() or "_" in number:
            raise ValueError
        value = round(float(number) * units.get(unit, 1.0), 12)  # 35ms is 0.035, not the double behind it
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a duration; seconds, or a number with ms, s, m, h or d (600, 10ms, 10m, 1d)"
        ) from None
    said = text if unit else f"{text} s"
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"{said}; must be finite and greater than 0")
    if not SHORTEST_S <= value <= LONGEST_S:
        raise argparse.ArgumentTypeError(f"{said}; from {SHORTEST_S:g} s to {LONGEST_S / 86400:g} days")
    return value


def whole(least: int, most: int) -> Callable[[str], int]:
    """What reads a whole number within limits."""

    def read(text: str) -> int:
        digits = text.removeprefix("-")
        if not (digits.isascii() and digits.isdigit()) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"'{text}': a whole number from {least} to {most}")
        return int(text)

    return read


def voice(name: str, quiet: bool) -> Callable[[str], None]:
    """What says a line on stderr, or keeps it."""

    def say(text: str) -> None:
        if not quiet:
            print(f"{name}: {text}", file=sys.stderr, flush=True)

    return say


def guarded(name: str, work: Callable[[Stop], int]) -> int:
    """Does the work of a shell; its exit status. What goes wrong becomes lines on stderr."""
    with Stop() as stop:  # before the slow imports, so that a signal during them is heard too
        from gnss_hil.dbc.bus.base import LinkClosed, LinkError, UnknownBus

        try:
            return work(stop)
        except (Mistake, UnknownBus) as error:
            return _failed(name, 2, error)
        except LinkError as error:
            return _failed(name, 3, error)
        except (LinkClosed, Broken) as error:
            return stop.status if stop() else _failed(name, 1, error)


def _failed(name: str, status: int, error: Exception) -> int:
    for line in str(error).splitlines():
        print(f"{name}: {line}", file=sys.stderr)
    return status
