"""The bus of a replay, and the software on its other side."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from gnss_hil.dbc.bus.base import Link, LinkClosed, LinkError, NotYet
from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.open_link import is_shared, open_link
from gnss_hil.dbc.bus.probe import senders_heard
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.flightsw.app.config import carried_over
from gnss_hil.tools.common.errors import Failed, Mistake
from gnss_hil.tools.processes import children
from gnss_hil.tools.processes.bus_tap import LISTEN_S
from gnss_hil.tools.processes.children import LEAVE_S, Child, bus_environment, start
from gnss_hil.tools.recording.run_folder import SCENARIO
from gnss_hil.tools.replay.source import Source, scenario_of

DRAIN_S = 1.0
"""Its last frames may still be under way when a process is gone."""


@contextmanager
def bus(spec: str, runtime_dir: Path, note: Callable[[str], None]) -> Iterator[str]:
    """A bus to replay on; its specification.

    embedded            a runtime_dir hub
    embedded:PATH       the bench that serves PATH, else a hub of our own there
    INTERFACE:CHANNEL   as everywhere
    """
    if spec == "embedded":
        with Hub(runtime_dir / "can0"):
            yield f"embedded:{runtime_dir / 'can0'}"
    elif served(spec):
        yield spec
    else:
        with Hub(Path(spec.partition(":")[2])):
            note(f"a bus of our own at {spec}, while this replay lasts")
            yield spec


def served(spec: str) -> bool:
    """Whether a bus is there; False for one that we could make. LinkError if it can be neither."""
    try:
        open_link(spec).close()
    except NotYet:
        return False
    return True


@contextmanager
def joined(spec: str, codec: Codec, played: set[str]) -> Iterator[Link]:
    """A link on a bus on which the nodes that will be played are silent."""
    link = open_link(spec)
    try:
        heard = senders_heard(link, codec, played, LISTEN_S) if is_shared(spec) else set()
        if heard:
            raise LinkError(f"bus '{spec}': {', '.join(sorted(heard))} of another bench can be heard there")
        yield link
    except LinkClosed as error:
        raise Failed(f"bus '{spec}': {error or 'gone'}") from None
    finally:
        link.close()


class Other:
    """The software on the other side: a process that was started here, or one that was not."""

    def __init__(self, child: Child | None):
        self._child = child
        self._gone_s: float | None = None

    @property
    def started(self) -> bool:
        return self._child is not None

    @property
    def gone(self) -> bool:
        """Whether its process has ended, and all that it sent has arrived."""
        if self._child is None or self._child.running:
            return False
        now_s = time.monotonic()
        self._gone_s = now_s if self._gone_s is None else self._gone_s
        return now_s - self._gone_s >= DRAIN_S

    def end(self, complete: bool, interrupted: bool) -> None:
        """Lets it leave after a replay that went to its end; Failed or its own refusal if it broke off."""
        child = self._child
        if child is None or interrupted:
            return
        if complete:
            child.wait(LEAVE_S)
            child.leave()
        if not complete and not child.running:
            raise child.refusal()
        if not child.sent_away and child.process.returncode:
            raise Failed(child.how_it_ended())


@contextmanager
def other_side(
    command: Sequence[str] | None, role: str, environment: Mapping[str, str], words: Path | None
) -> Iterator[Other]:
    """Starts the other side, and sends it away at the end.

    command  None: it is not started here
    environment  additions to its environment
    words    file for its stderr; None lets it pass
    """
    if command is None:
        yield Other(None)
        return
    child = start(role, command, words, environment)
    try:
        yield Other(child)
    finally:
        child.leave()


def words_of(command: str) -> list[str]:
    return shlex.split(command)


def flight_command(
    source: Source, spec: str, policy: str | None, navigator: str | None, options: Sequence[str]
) -> list[str]:
    """Our flight software; as the run had it, but for what is asked for.

    The run's navigator and options belong to its policy: another policy comes without them, as in a run;
    another navigator comes without the options that the run's alone has. An option that is given replaces
    the run's value of it.
    """
    if source.scenario is not None and policy is None:
        flight = source.scenario.craft[source.number].flight
        policy, navigator = flight.policy, navigator or flight.navigator
        given = {option.partition("=")[0] for option in options}
        kept = {key: value for key, value in flight.options.items() if key not in given}
        with suppress(ValueError):  # a name that is not known is the flight software's to refuse
            kept = carried_over(kept, policy, flight.navigator, navigator)
        options = [*children.option_texts(kept), *options]
    return children.flight_command(need_vehicle(source), spec, policy or "patent", navigator, options)


def emulator_command(source: Source, spec: str, wait_s: float) -> list[str]:
    """Our emulator, with the run's scenario."""
    return [
        sys.executable, "-P", "-m", "gnss_hil.emulator",
        str(need_scenario(source)), "--bus", spec, "--quiet",
        "--session", str(source.recorded.session), "--wait", f"{wait_s:g}",
    ]  # fmt: skip


def environment_of(source: Source, spec: str, of_run: bool) -> dict[str, str]:
    """Additions to the environment of a third party's software."""
    words = bus_environment(spec, need_vehicle(source), source.craft)
    if of_run:
        words["GNSS_HIL_SCENARIO"] = str(need_scenario(source).absolute())
        words["GNSS_HIL_PACE"] = "lockstep"
        words["GNSS_HIL_DURATION"] = f"{scenario_of(source)[1].time.duration_s:.12g}"
    return words


def need_vehicle(source: Source) -> Path:
    if source.vehicle is None:
        raise Mistake(
            f"{source.recorded.recording.path}: is in no run folder; name its vehicle with --vehicle"
        )
    return source.vehicle


def need_scenario(source: Source) -> Path:
    if source.folder is None:
        raise Mistake(
            f"{source.recorded.recording.path}: is in no run folder; an emulator needs its scenario"
        )
    if not source.alone:
        raise Mistake(f"{source.folder}: has several craft; start its emulator yourself, on one bus for each")
    return source.folder / SCENARIO
