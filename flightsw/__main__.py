"""`python -m gnss_hil.flightsw`: the flight software as a process on a bus.

It waits for a run, flies it, and waits for the next.
"""

from __future__ import annotations

import os
import sys

# One BLAS thread, before NumPy is loaded: the same sums in the same order, and no spinning helpers.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import gc
from collections.abc import Sequence

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.process import command_line

EXAMPLES = """\
examples:
  python -m gnss_hil.flightsw --vehicle soyuz-ms.toml --bus socketcan:vcan0
  python -m gnss_hil.flightsw --vehicle soyuz-ms.toml --bus embedded:/run/bus.sock --policy prototype --once
  python -m gnss_hil.flightsw --vehicle soyuz-ms.toml --bus socketcan:can0 --option hysteresis_deg=2

BUS is embedded:/path.sock, socketcan:vcan0 (socketcan:can0,paced spreads bursts over bit time), or any
python-can INTERFACE:CHANNEL. Without --once it waits for a bench that does not serve embedded:/path.sock
yet, and for any bus that went away.
Exit status: 0 done; 1 the bus went away; 2 bad usage or vehicle file;
3 the environment lacks something; 130 interrupted."""


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
    add("--navigator", metavar="NAME", help="how measurements become a fix, if not as the policy has it")
    add(
        "--option",
        metavar="K=V",
        action="append",
        default=[],
        help="an option of the policy, of the navigator, or of any flight",
    )
    add(
        "--boot-count",
        metavar="N",
        type=command_line.whole(0, 2**31 - 1),
        default=0,
        help="starts since commissioning",
    )
    add("--status", metavar="FILE|fd:N", help="write epochs and fixes flown here, a JSON line at a run's end")
    add("--once", action="store_true", help="leave when the first run is over, or the bus is gone")
    add("--quiet", action="store_true", help="nothing on stderr but mistakes")


def main(argv: Sequence[str] | None = None) -> int:
    parser = command_line.parser_of(
        "python -m gnss_hil.flightsw", "Navigates a spacecraft by what it receives on a bus.", EXAMPLES
    )
    add_arguments(parser)
    return run(parser.parse_args(argv))


def run(arguments: argparse.Namespace) -> int:
    """Flies by the arguments; the exit status. Mistakes become lines on stderr."""
    return command_line.guarded("flightsw", lambda stop: _fly(arguments, _config(arguments), stop))


def _config(arguments: argparse.Namespace):
    from gnss_hil.dbc.common import vehicle
    from gnss_hil.flightsw.app.config import configure

    try:
        craft = vehicle.load(vehicle.find(arguments.vehicle))
        options = _options(arguments.option)
        return configure(
            craft, arguments.policy, options, arguments.boot_count, navigator_name=arguments.navigator
        )
    except ValueError as error:  # a vehicle file, a policy or an option that cannot be used
        raise command_line.Mistake(error) from None


def _fly(arguments: argparse.Namespace, config, stop) -> int:
    from gnss_hil.dbc.bus.base import LinkClosed
    from gnss_hil.dbc.lockstep import messages
    from gnss_hil.dbc.lockstep.slave_loop import run_slave
    from gnss_hil.dbc.lockstep.slave_protocol import Slave
    from gnss_hil.dbc.process.bus_link import regain_link
    from gnss_hil.dbc.process.status_log import StatusLog
    from gnss_hil.flightsw.app.state import heartbeat, initial_state
    from gnss_hil.flightsw.app.step import flight_step

    state = initial_state(config)
    epochs = fixes = 0

    def play(block, fresh):
        nonlocal state, epochs, fixes
        state, answer = flight_step(config, initial_state(config) if fresh else state, block)
        epochs, fixes = epochs + 1, fixes + (state.solution.fix is not None)
        return answer

    say = command_line.voice("flightsw", arguments.quiet)
    slave = Slave(config.codec)
    link = _join(arguments, config.codec, stop, say)
    gc.freeze()  # what was built before the loop lives through it: nothing there to collect
    try:
        while link is not None:
            say(f"on {arguments.bus}, waiting for a run")
            try:
                progress = run_slave(link, slave, heartbeat(config), play, stop, arguments.once)
                return 0 if arguments.once and progress.runs_ended else stop.status
            except LinkClosed as error:
                if arguments.once or stop():
                    raise
                say(f"{error}; waiting for it to come back")
                link.close()
                link = regain_link(arguments.bus, stop)
        return stop.status
    finally:
        if link is not None:
            link.close()
        with StatusLog(arguments.status) as status:
            status.tell("ended", epochs=epochs, fixes=fixes)
        if refused := messages.explain(slave.refused):
            say(refused)
        if slave.refused_marks:
            say(f"{so_many(slave.refused_marks, 'time mark')} left out: no epoch followed")
        if not arguments.quiet:
            _report_rejections(config.codec, state.rejected)
            if state.single_fixes:
                many = so_many(state.single_fixes, "fix", "fixes")
                say(f"{many} by one signal of each satellite: too few pairs")


def _join(arguments: argparse.Namespace, codec, stop, say):
    """A link on a bus without another flight software; None if `stop` came first."""
    from gnss_hil.dbc.bus.base import LinkError
    from gnss_hil.dbc.bus.open_link import is_shared
    from gnss_hil.dbc.bus.probe import senders_heard
    from gnss_hil.dbc.process.bus_link import await_link

    link = await_link(arguments.bus, stop, say, 0 if arguments.once else None)
    if link is not None and is_shared(arguments.bus) and senders_heard(link, codec, {"FLIGHT"}):
        link.close()
        raise LinkError(f"bus '{arguments.bus}': another flight software can be heard there")
    return link


def _report_rejections(codec, rejected) -> None:
    """What was received and not used: where, how often, why, and with what consequence."""
    from gnss_hil.flightsw.io.frame_statistics import rejection_table

    for reason, where, count, consequence in rejection_table(codec, rejected):
        print(f"flightsw: {count} x {reason} at {where}: {consequence}", file=sys.stderr, flush=True)


def _options(pairs: Sequence[str]) -> dict[str, command_line.Value]:
    """Options of the command line; numbers and true/false are taken as such."""
    options = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals or not key or key in options:
            raise ValueError(f"--option {pair}: each option once, as KEY=VALUE")
        options[key] = command_line.option_value(text)
    return options


if __name__ == "__main__":
    sys.exit(main())
