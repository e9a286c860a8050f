"""Instructions that an epoch of `soyuz` costs: `python -m tests.benchmarks.instructions`.

Instructions are counted by valgrind on its own model of a processor: they do not depend on what else runs,
and hardly on the machine. One process builds everything and plays WARM_UP epochs of a run made before; then
it forks a child for each part, which plays EPOCHS more and ends, and one that does nothing: valgrind counts
each from the beginning, so the difference is the part's alone.

Beside the parts: what faults cost that lie in wait, one and ten, and what a gateway does between two buses,
without faults and with one that waits, as a share of the whole.

Exit status 1 if a part costs more than its limit by MARGIN.
"""

from __future__ import annotations

import gc
import io
import math
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from gnss_hil.dbc.contract.frames import EMPTY, concat
from gnss_hil.emulator import assemble
from gnss_hil.emulator.faults import engine, files
from gnss_hil.emulator.faults.engine import FaultPlan
from gnss_hil.emulator.faults.kinds.row import GATEWAY
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.tools.recording import recorder
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.plan import Plan, make
from tests.benchmarks.between import Tape, meeting, passing

WARM_UP, EPOCHS = 120, 60
"""Commanded channels are at work; whole blocks of the environment are measured."""

LIMITS = {"emulator": 1.75, "flight": 5.8, "recorder": 0.67}
"""Million instructions an epoch: what was measured last, to be lowered with every gain."""

WAITING = {
    "one fault": ("rx2 off @10h+30s",),
    "ten faults": (*(f"rx{1 + k % 4} ch{k % 6} RANGE.pseudorange_m += 30 @10h+{k + 1}s" for k in range(10)),),
}
"""Faults that have nothing to do in what is counted."""

BETWEEN = {"gateway": (), "gateway, one fault": WAITING["one fault"]}
"""Faults of gateways, likewise."""

MARGIN = 1.15
"""For other versions of Python and its libraries."""


def taped(plan: Plan, epochs: int) -> Tape:
    """The first epochs of a run."""
    (name,), (config,) = plan.names, plan.flights
    emulated, flown, answer = assemble.initial_state(plan.world), initial_state(config), EMPTY
    tape = []
    for epoch in range(epochs):
        emulated, sent, _ = emulate_step(plan.world, emulated, {name: answer}, epoch)
        flown, answer = flight_step(config, flown, sent[name])
        tape.append((sent[name], answer))
    return tape


def parts(plan: Plan, tape: Tape) -> dict[str, Callable[[range], None]]:
    """Each part, as what plays its next epochs."""
    (name,), (config,) = plan.names, plan.flights
    emulated, flown = assemble.initial_state(plan.world), initial_state(config)
    worlds = {name: make("soyuz", Overrides(faults=faults)).world for name, faults in WAITING.items()}
    armed = {name: assemble.initial_state(world) for name, world in worlds.items()}
    log = recorder.Recorder(
        {"can0": config.codec}, plan.scenario.time.start_ns, plan.scenario.time.interval_ns, io.BytesIO()
    )

    def emulate(epochs: range) -> None:
        nonlocal emulated
        for epoch in epochs:
            answer = tape[epoch - 1][1] if epoch else EMPTY
            emulated, _, _ = emulate_step(plan.world, emulated, {name: answer}, epoch)

    def waiting(which: str) -> Callable[[range], None]:
        def emulate(epochs: range) -> None:
            for epoch in epochs:
                answer = tape[epoch - 1][1] if epoch else EMPTY
                armed[which], _, _ = emulate_step(worlds[which], armed[which], {name: answer}, epoch)

        return emulate

    def fly(epochs: range) -> None:
        nonlocal flown
        for epoch in epochs:
            flown, _ = flight_step(config, flown, tape[epoch][0])

    def record(epochs: range) -> None:
        for epoch in epochs:
            log.add(0, epoch, concat(tape[epoch]))
        log.flush()

    between = {one: passing(tape, _armed(plan, faults)) for one, faults in BETWEEN.items()}
    buses = meeting(tape, config.codec)
    waits = {one: waiting(one) for one in WAITING}
    return {"emulator": emulate, "flight": fly, "recorder": record, **waits, **between, "buses": buses}


def _armed(plan: Plan, faults: Sequence[str]) -> FaultPlan:
    """Faults of a gateway at the bus of the run's craft."""
    (name,), (config,) = plan.names, plan.flights
    given = files.gathered((), faults)
    interval_ns = plan.scenario.time.interval_ns
    return engine.armed(given, name, config.vehicle, config.codec, interval_ns, 1, link=GATEWAY)


def counted(file: Path) -> None:
    """Inside valgrind: plays what is counted, and prints which process played what."""
    recorder.FLUSH_S = math.inf  # by number alone: valgrind is slow
    plays = parts(make("soyuz"), pickle.loads(file.read_bytes()))
    for play in plays.values():
        play(range(WARM_UP))
    gc.collect()
    gc.freeze()
    for name, play in {"nothing": lambda epochs: None, **plays}.items():
        if child := os.fork():
            os.waitpid(child, 0)
            print(name, child, flush=True)
        else:
            play(range(WARM_UP, WARM_UP + EPOCHS))
            os._exit(0)


def measured() -> dict[str, float]:
    """Million instructions an epoch of each part."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "tape"
        file.write_bytes(pickle.dumps(taped(make("soyuz"), WARM_UP + EPOCHS)))
        command = [
            "valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null",
            f"--log-file={folder}/%p.log", sys.executable, "-m", "tests.benchmarks.instructions", str(file),
        ]  # fmt: skip
        environment = {
            **os.environ,
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
            "PYTHONHASHSEED": "0",
        }
        done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
        children = dict(line.rsplit(maxsplit=1) for line in done.stdout.splitlines())
        counts = {name: _instructions(Path(folder) / f"{child}.log") for name, child in children.items()}
    start = counts.pop("nothing")
    return {name: (count - start) / EPOCHS / 1e6 for name, count in counts.items()}


def _instructions(log: Path) -> int:
    return int(re.search(r"I\s+refs:\s+([\d,]+)", log.read_text())[1].replace(",", ""))


def too_many(found: Mapping[str, float]) -> list[str]:
    """Parts beyond their limits and the margin."""
    return [name for name, limit in LIMITS.items() if found[name] > limit * MARGIN]


def table(found: Mapping[str, float]) -> str:
    lines = [f"  {name:20}{found[name]:8.2f}   limit {limit:.2f}" for name, limit in LIMITS.items()]
    together = sum(found[name] for name in LIMITS)
    lines.append(f"  {'together':20}{together:8.2f}")
    for name in WAITING:
        more = found[name] - found["emulator"]
        lines.append(f"  {name:20}{more:8.2f}   that waits, {more / together:.1%} of it")
    for name in BETWEEN:
        more = found[name] - found["buses"]
        lines.append(f"  {name:20}{more:8.2f}   {more / together:.1%} of it")
    return "\n".join(["million instructions an epoch of soyuz, inline", *lines])


def main() -> int:
    if shutil.which("valgrind") is None:
        print("valgrind is missing (Debian package valgrind): instructions were not counted")
        return 3
    found = measured()
    print(table(found))
    return int(bool(too_many(found)))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        counted(Path(sys.argv[1]))
    else:
        sys.exit(main())
