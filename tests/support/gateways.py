"""A bench with a gateway in it: an emulator on one bus, a flight software on another, faults between them."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from gnss_hil.dbc.bus.base import frames_from_wire
from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.lockstep.messages import is_bench
from tests.support.programs import GNSS_HIL
from tests.support.waiting import until


def through(
    folder: Path, faults: Sequence[str], flight: Sequence[str], duration: int = 130, scenario: str = "soyuz"
) -> tuple[FrameBatch, str]:
    """Flies a scenario through a gateway: what was on the flight software's bus, in order; what the gateway
    said.

    flight   command of the flight software; BUS in it stands for the path of its bus
    The run is in folder/run, what faults did in folder/gateway.
    """
    heard: list[bytes] = []
    inner, outer = folder / "flight.sock", folder / "emulator.sock"
    with ExitStack() as stack:
        stack.enter_context(Hub(inner, [lambda sender, wire: heard.append(wire)]))

        def start(name: str, *command: str) -> subprocess.Popen:
            said = stack.enter_context((folder / f"{name}.txt").open("w"))
            process = subprocess.Popen(command, stdout=said, stderr=said, stdin=subprocess.DEVNULL)
            stack.callback(lambda: process.poll() is None and process.kill())
            return process

        buses = ("--from", f"embedded:{outer}", "--to", f"embedded:{inner}")
        out = ("--seed", "1", "--out", str(folder / "gateway"))
        words = ("--bus", f"embedded:{outer}", "--flight", "external", "--quiet", "--no-report")
        length = ("--duration", str(duration), "--out", str(folder / "run"))
        gateway = start("gateway", *GNSS_HIL, "inject", *faults, *buses, *out)
        flown = start("flight", *(word.replace("BUS", str(inner)) for word in flight))
        played = start("run", *GNSS_HIL, "run", scenario, *length, *words)
        every = (played, gateway, flown)
        until(lambda: all(one.poll() is not None for one in every) or gateway.poll() or flown.poll())
        said = {name: (folder / f"{name}.txt").read_text() for name in ("run", "gateway", "flight")}
        assert gateway.returncode == flown.returncode == 0, said
        assert (folder / "run" / "summary.json").exists(), said
    return frames_from_wire(b"".join(heard))[0], said["gateway"]


OURS = (*GNSS_HIL, "fly", "--vehicle", "soyuz-ms", "--bus", "embedded:BUS", "--once", "--quiet")
"""Our flight software, as `through` takes it."""


def spoken(frames: FrameBatch) -> list[str]:
    """Frames of a run as ID#DATA, from the first mark on, without bench frames."""
    frames = frames[~is_bench(frames.can_id)]
    frames = frames[int((frames.can_id == 0x010).argmax()) :]
    return [
        f"{can_id:03X}#{bytes(data[:length]).hex().upper()}"
        for can_id, data, length in zip(frames.can_id.tolist(), frames.data, frames.length, strict=True)
    ]


def on_record(folder: Path) -> list[str]:
    """Frames of a bus.log, likewise."""
    lines = (line.split()[2] for line in (folder / "bus.log").read_text().splitlines())
    return [text for text in lines if text[:3] not in ("7D0", "7D1", "7DE")]
