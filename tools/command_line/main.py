"""The command line, `gnss-hil`: one table of commands, one place where mistakes become a line and a status.

Start-up counts: nothing heavy is imported before a command is known, and then only that command's modules.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TextIO

from gnss_hil.dbc.common.near import did_you_mean, hint
from gnss_hil.dbc.process.shutdown import interruptible, status_of
from gnss_hil.tools.common.errors import PROGRAM, Mistake

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Of BLAS, said before NumPy is loaded: the same sums in the same order, and no spinning helpers."""


@dataclass(frozen=True, slots=True)
class Command:
    """A command; its module, `gnss_hil.tools.commands.NAME`, has `add_arguments(parser)` and
    `run(arguments)`, which returns the exit status."""

    name: str
    help: str
    examples: tuple[str, ...]

    @property
    def module(self) -> str:
        return f"gnss_hil.tools.commands.{self.name}"


COMMANDS = {
    c.name: c
    for c in (
        Command(
            "run", "play a scenario: emulator, bus, flight software, recorder, summary",
            (
                "run",
                "run soyuz-roll --bus inline",
                "run soyuz --nav brdc3050.12n --nav brdc3050.12g --duration 86400 --bus inline --no-log",
                "run soyuz --fault 'rx2 off @2m+30s' --fault 'G12 range +30 m @4m+1m'",
                "run soyuz --policy prototype --autonomous elevation --out runs/prototype",
            ),
        ),
        Command(
            "emulate", "the emulator alone, on a bus of yours",
            ("emulate soyuz --bus socketcan:vcan0 --pace realtime",),
        ),
        Command(
            "fly", "the flight software alone, on a bus of yours",
            ("fly --vehicle soyuz-ms.toml --bus socketcan:vcan0",),
        ),
        Command(
            "report", "a run's tables, summary and report.html again; or two runs compared",
            ("report runs/patent", "report runs/patent runs/prototype --out compared.html"),
        ),
        Command(
            "replay", "play a recording again: one side against real software, or all of it",
            (
                "replay runs/patent --only emulator --same",
                "replay RUN --only emulator --flight ./mine --report runs/mine",
                "replay trace.blf --only emulator --bus socketcan:vcan0 --pace realtime",
                "replay RUN --only flight --bus socketcan:can0",
                "replay RUN --bus socketcan:vcan0 --pace x10",
            ),
        ),
        Command(
            "convert", "a recording in another format: .log, .asc, .blf, .mf4; or its signals: .parquet",
            (
                "convert runs/patent soyuz.blf",
                "convert trace.asc trace.log",
                "convert trace.blf signals.parquet --dbc mine.dbc",
            ),
        ),
        Command(
            "export", "what a run measured, for other software: RINEX, CCSDS OEM, SP3; or its sky",
            (
                "export rinex runs/patent --out rinex",
                "export oem runs/patent --truth",
                "export sp3 runs/patent",
                "export sky runs/patent --out sky",
            ),
        ),
        Command(
            "study", "many runs compared: error factors one at a time, on two craft",
            ("study factors", "study factors --factor ephemeris_error --duration 6000 --interval 10"),
        ),
        Command(
            "completion", "a script by which bash, zsh or fish complete commands and options",
            ("completion bash > ~/.local/share/bash-completion/completions/gnss-hil",),
        ),
        Command(
            "faults", "kinds of faults on the bus, and fault files checked",
            ("faults list", "faults show replay", "faults check mine.toml 'rx2 off @2m+30s'"),
        ),
        Command(
            "inject", "a gateway between two buses: faults for a flight software of yours, unchanged",
            (
                "inject 'rx2 off @2m+30s' --from embedded:/tmp/a --to embedded:/tmp/b",
                "inject replay mine.toml --from socketcan:vcan0 --to socketcan:can0 --out runs/gateway",
                "inject 'rx1 RANGE loss' --as-cangw --from socketcan:vcan0 --to socketcan:vcan1 > rules.sh",
            ),
        ),
        Command("scenarios", "what ships with the bench", ("scenarios",)),
        Command(
            "schema", "JSON schemas of scenario, vehicle, structure and fault files, for editors",
            ("schema --out .", "schema scenario"),
        ),
        Command(
            "vcan", "virtual CAN: on this kernel, or in a user-mode Linux without root",
            (
                "vcan up",
                "vcan shell -- gnss-hil run soyuz --bus socketcan:vcan0",
                "vcan shell --mem 512M -- candump vcan0",
            ),
        ),
        Command(
            "hub", "an embedded bus without a run, which programs of yours may join",
            ("hub /tmp/bus",),
        ),
        Command(
            "monitor", "listen on a bus: every frame decoded and checked, live",
            (
                "monitor --bus socketcan:vcan0",
                "monitor --only 'NAV_*' --duration 10 | head",
                "monitor --bus embedded:/tmp/bus --vehicle soyuz-ms --only RX1,COMMAND,0x7D0-0x7DE --raw",
            ),
        ),
        Command(
            "icd", "the bus contract: interface control document, DBC, hash, budget",
            (
                "icd --html",
                "icd dbc --receivers 2 > two.dbc",
                "icd html soyuz-roll --out icd.html",
                "icd hash",
                "icd budget soyuz",
            ),
        ),
    )
}  # fmt: skip


class Parser(argparse.ArgumentParser):
    """argparse whose errors are one line."""

    def error(self, message: str):
        told = f"{message.removeprefix('argument ')}{self._meant(message)}"
        raise Mistake(f"{told} (see {self.prog} --help)")

    def parse_mixed(self, argv: Sequence[str], into: argparse.Namespace) -> argparse.Namespace:
        """`parse_args` with options before, between and behind the rest, but where the rest is another's
        command line."""
        others = (argparse.PARSER, argparse.REMAINDER)
        if any(action.nargs in others for action in self._get_positional_actions()):
            return self.parse_args(argv, into)
        return self.parse_intermixed_args(argv, into)

    def _meant(self, message: str) -> str:
        """What was probably meant by an option or a choice that there is not."""
        if unknown := re.match(r"unrecognized arguments: (--[^\s=]+)", message):
            return hint(unknown[1], self._option_string_actions)
        if chosen := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)$", message):
            return hint(chosen[1], re.findall(r"[^\s',]+", chosen[2]))
        return ""


def overview() -> str:
    """The text of `gnss-hil --help`."""
    width = max(map(len, COMMANDS))
    lines = [
        f"usage: {PROGRAM} COMMAND [...]      {PROGRAM} COMMAND --help      {PROGRAM} --version",
        "",
        "A bench for spacecraft satellite navigation on CAN: an emulator plays the receivers, the flight",
        "software commands them and publishes fixes, everything between them is frames.",
        "",
        *(f"  {c.name:<{width}}  {c.help}" for c in COMMANDS.values()),
        "",
        "examples:",
        *(f"  {PROGRAM} {example}" for c in COMMANDS.values() for example in c.examples[:2]),
        "",
        "exit status: 0 done; 1 run failed, an expectation missed, frames of a recording not converted, or",
        "             none in it;",
        "             2 bad usage, scenario or input; 3 the environment lacks something;",
        "             130 interrupted; 143 terminated; 129 hung up",
    ]
    return "\n".join(lines)


def parser_of(command: Command) -> Parser:
    """The argument parser of one command."""
    parser = Parser(
        prog=f"{PROGRAM} {command.name}",
        description=command.help[0].upper() + command.help[1:] + ".",
        epilog="examples:\n" + "\n".join(f"  {PROGRAM} {example}" for example in command.examples),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    import_module(command.module).add_arguments(parser)
    parser.add_argument("--debug", action="store_true", help="show where in the program a failure arose")
    return parser


def _dispatch(argv: Sequence[str]) -> int:
    if not argv or argv[0] in ("-h", "--help", "help"):
        print(overview())
        return 0
    if argv[0] == "--version":
        from importlib.metadata import version

        print(f"{PROGRAM} {version(PROGRAM)}")
        return 0
    if argv[0] not in COMMANDS:
        raise Mistake(f"unknown command '{argv[0]}'; {did_you_mean(argv[0], COMMANDS, 'commands are')}")
    command = COMMANDS[argv[0]]
    told = argparse.Namespace(command_line=shlex.join([PROGRAM, *argv]))
    arguments = parser_of(command).parse_mixed(argv[1:], told)
    return import_module(command.module).run(arguments)


def status_and_text(error: BaseException) -> tuple[int, str] | None:
    """Exit status and text of an error that people can understand; None if it is a fault of the program.

    The classes are looked up among loaded modules: what is not loaded cannot have been raised.
    """
    if isinstance(error, Mistake):
        return error.status, str(error)
    for module, name, status in (
        ("gnss_hil.emulator.config.scenario", "ScenarioError", 2),
        ("gnss_hil.dbc.common.vehicle", "VehicleError", 2),
        ("gnss_hil.emulator.faults.models", "FaultError", 2),
        ("gnss_hil.dbc.bus.base", "UnknownBus", 2),
        ("gnss_hil.dbc.bus.base", "LinkError", 3),
        ("gnss_hil.emulator.orbits.dynamics", "OrbitError", 2),
        ("gnss_hil.emulator.error_models.checked", "ModelError", 1),
        ("gnss_hil.tools.recording.formats.piece", "LogError", 2),
        ("gnss_hil.tools.results.truth", "TruthError", 2),
    ):
        if module in sys.modules and isinstance(error, getattr(sys.modules[module], name)):
            return status, str(error)
    if isinstance(error, OSError) and error.strerror:  # disk full, no permission
        return 1, f"{error.filename or 'standard output'}: {error.strerror}"  # files have names
    return None


def _open_missing_streams() -> None:
    """A process may be started with stdout or stderr closed; then what it says there goes nowhere."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - for the rest of the process


def _empties(stream: TextIO) -> bool:
    """Whether a stream gets rid of what it holds."""
    try:
        stream.flush()
    except OSError:
        return False
    return True


def _give_up_unwritable() -> None:
    """What a stream cannot get rid of is dropped, or the interpreter would complain of it at its end."""
    for stream in (sys.stdout, sys.stderr):
        if not _empties(stream):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; the exit status."""
    os.environ.update(ONE_THREAD)
    argv = list(sys.argv[1:] if argv is None else argv)
    _open_missing_streams()
    try:
        with interruptible():  # before the slow imports, so that a signal during them has its line too
            status = _dispatch(argv)
            sys.stdout.flush()  # at the interpreter's end a failure would have no words
            return status
    except SystemExit as request:  # argparse's --help
        return int(request.code or 0)
    except KeyboardInterrupt as interrupt:
        print(": ".join([PROGRAM, *argv[:1], "interrupted"]), file=sys.stderr)
        return status_of(interrupt)
    except BrokenPipeError:  # the reader of our output has left
        return 0
    except Exception as error:
        known = status_and_text(error)
        if "--debug" in argv:
            raise
        status, text = known or (1, f"internal error: {type(error).__name__}: {error} (--debug shows where)")
        for line in text.splitlines() or [type(error).__name__]:
            print(f"{PROGRAM}: {line}", file=sys.stderr)
        return status
    finally:
        _give_up_unwritable()


if __name__ == "__main__":
    sys.exit(main())
