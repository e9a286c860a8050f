"""`python -m flightsw`: the flight software as a process on a bus. It waits for a run, flies it, and waits
for the next."""

from __future__ import annotations

import os
import sys

# One BLAS thread, before NumPy is loaded: the same sums in the same order, and no spinning helpers.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import gc
from collections.abc import Sequence

EXAMPLES = """\
examples:
  python -m flightsw --vehicle soyuz-ms.toml --bus socketcan:vcan0
  python -m flightsw --vehicle soyuz-ms.toml --bus embedded:/run/bench/bus.sock --policy prototype --once
  python -m flightsw --vehicle soyuz-ms.toml --bus socketcan:can0 --policy patent --option hysteresis_deg=2

BUS is embedded:/path.sock, socketcan:vcan0 (socketcan:can0,paced spreads bursts over bit time), or any
python-can INTERFACE:CHANNEL. Exit status: 0 done; 1 the bus went away; 2 bad usage or vehicle file;
3 the environment lacks something; 130 interrupted."""


class Parser(argparse.ArgumentParser):
    def error(self, message: str):
        self.exit(2, f"{self.prog}: {message} (see --help)\n")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments, also for `gnss-hil fly`."""
    add = parser.add_argument
    add(
        "--vehicle",
        metavar="FILE",
        required=True,
        help="vehicle file, or a shipped one by name",
    )
    add("--bus", metavar="BUS", required=True, help="where the emulator is, or will be")
    add("--policy", metavar="NAME", default="patent", help="which antenna tracks which satellite")
    add("--option", metavar="K=V", action="append", default=[], help="an option of the policy")
    add("--boot-count", metavar="N", type=int, default=0, help="starts since commissioning")
    add("--once", action="store_true", help="leave when the first run is over")
    add("--quiet", action="store_true", help="nothing on stderr but mistakes")


def main(argv: Sequence[str] | None = None) -> int:
    parser = Parser(
        prog="python -m flightsw",
        description="Navigates a spacecraft by what it hears on a bus.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_arguments(parser)
    return run(parser.parse_args(argv))


def run(arguments: argparse.Namespace) -> int:
    """Flies what the arguments say; the exit status. Mistakes become lines on stderr."""
    from dbc.link.stopping import INTERRUPTED, Stop

    with Stop() as stop:  # before the slow imports, so that a signal during them is heard too
        from dbc import vehicle
        from dbc.link.base import LinkClosed, LinkError
        from flightsw.step import configure

        try:
            craft = vehicle.load(vehicle.find(arguments.vehicle))
            config = configure(craft, arguments.policy, _options(arguments.option), arguments.boot_count)
        except ValueError as error:  # a vehicle file, a policy or an option that cannot be used
            return _failed(2, error)
        try:
            return _fly(arguments, config, stop)
        except LinkError as error:
            return _failed(3, error)
        except LinkClosed as error:
            return INTERRUPTED if stop() else _failed(1, error)


def _fly(arguments: argparse.Namespace, config, stop) -> int:
    from dbc.link.base import LinkError, is_shared, open_link
    from dbc.link.follow import follow
    from dbc.link.follower import Follower
    from dbc.link.occupied import occupied
    from dbc.link.stopping import INTERRUPTED
    from flightsw.step import flight_step, heartbeat, initial_state

    state = initial_state(config)

    def play(block, fresh):
        nonlocal state
        state, answer = flight_step(config, initial_state(config) if fresh else state, block)
        return answer

    link = open_link(arguments.bus)
    try:
        if is_shared(arguments.bus) and occupied(link, config.codec, {"FLIGHT"}):
            raise LinkError(f"bus '{arguments.bus}': another flight software can be heard there")
        if not arguments.quiet:
            print(f"flightsw: on {arguments.bus}, waiting for a run", file=sys.stderr, flush=True)
        gc.freeze()  # what was built before the loop lives through it: nothing there to collect
        journey = follow(link, Follower(config.codec), heartbeat(config), play, stop, arguments.once)
    finally:
        link.close()
        if not arguments.quiet:
            _tell_rejections(config.codec, state.rejected)
    return 0 if arguments.once and journey.runs_ended else INTERRUPTED


def _tell_rejections(codec, rejected) -> None:
    """What was heard and not used: where, how often, why, and with what consequence."""
    from flightsw.rejections import rejection_table

    for reason, where, count, consequence in rejection_table(codec, rejected):
        print(f"flightsw: {count} x {reason} at {where}: {consequence}", file=sys.stderr, flush=True)


def _options(pairs: Sequence[str]) -> dict[str, float | bool | str]:
    """Options of the command line; numbers and true/false are taken as such."""
    options = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals or not key or key in options:
            raise ValueError(f"--option {pair}: each option once, as KEY=VALUE")
        options[key] = _value(text)
    return options


def _value(text: str) -> float | bool | str:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


def _failed(status: int, error: Exception) -> int:
    for line in str(error).splitlines():
        print(f"flightsw: {line}", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
