"""What a command line says of a real receiver that is played: its observations, its sky, its orbit."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.files.text import FileError
from gnss_hil.tools.common.errors import Mistake

PAIRS = {"gps": ("L1P", "L2P"), "glonass": ("L1OF", "L2OF")}
"""Signals of two frequencies, by system."""

SINGLE = {system.name: (signals.of_system(system)[0].name,) for system in systems.tracked()}
"""The preferred signal, by system."""


def change(document: dict[str, Any], a: Namespace) -> None:
    """Put what the command line says of observations and precise orbits into a scenario's document."""
    played = [
        craft
        for craft in document.get("craft", [])
        if isinstance(craft, dict) and isinstance(craft.get("observations"), dict)
    ]
    if not played:
        _refuse(a)
        if a.sp3:
            document.setdefault("sky", {})["orbits"] = _paths(a.sp3)
        return
    sky = document.setdefault("sky", {})
    if a.sp3 and a.nav:
        # Messages have what precise orbits lack: group delays, health, GLONASS frequencies.
        sky |= {"orbits": _paths(a.sp3), "reports": "orbits"}
    elif a.sp3:
        sky.update(_reported(a.sp3))
    for craft in played:
        _craft(craft, sky, a)
    if a.obs:
        _time(document, played[0], a)


def _refuse(a: Namespace) -> None:
    for name in ("obs", "reference", "ionosphere_free"):
        if getattr(a, name):
            option = name.replace("_", "-")
            raise Mistake(
                f"--{option}: no receiver is played in this scenario; use: gnss-hil run replay --obs FILE"
            )


def _reported(paths) -> dict[str, Any]:
    """[sky] of precise orbits: each system has the files that hold its satellites, or is "none"."""
    from gnss_hil.emulator.files import sp3

    try:
        held = {path: set(satellites.system_of(sp3.read(path).index).tolist()) for path in paths}
    except FileError as error:
        raise ScenarioError(f"--sp3: {error}") from None
    return {
        system.name: _paths(path for path in paths if system.value in held[path]) or "none"
        for system in systems.tracked()
    }


def _paths(paths: Iterable[Path]) -> list[str]:
    return [str(path.resolve()) for path in paths]


def _craft(craft: dict[str, Any], sky: dict[str, Any], a: Namespace) -> None:
    observations = craft["observations"]
    if a.obs:
        observations["file"] = str(a.obs.resolve())
    if not Path(observations.get("file", "")).is_file() and not a.obs:
        raise Mistake("replay: which observations? Give --obs FILE, and --sp3 or --nav for the satellites")
    if a.reference:
        observations["reference"] = {"oem": str(a.reference.resolve())}
    heard = [system.name for system in systems.tracked() if sky.get(system.name, "nominal") != "none"]
    if not heard:
        raise Mistake("replay: where are the satellites? Give --sp3 FILE or --nav FILE")
    if a.ionosphere_free:
        craft.setdefault("flight", {}).setdefault("options", {})["ionosphere_free"] = True
    if "signals" not in observations:
        table = SINGLE | PAIRS if a.ionosphere_free else SINGLE
        observations["signals"] = [signal for name in heard for signal in table[name]]


def _time(document: dict[str, Any], craft: dict[str, Any], a: Namespace) -> None:
    """Start, length and step of the file, but for what the command line or the scenario says."""
    from gnss_hil.emulator.receivers.recorded.assemble import span_of

    found = span_of(craft["observations"]["file"], craft.get("name", ""))
    said = {
        "duration_s": a.duration,
        "epoch_interval_s": a.interval,
        "orientation": document.get("time", {}).get("orientation"),
    }
    document["time"] = found | {name: value for name, value in said.items() if value is not None}
