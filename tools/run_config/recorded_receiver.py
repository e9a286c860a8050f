"""What is changed of a recorded receiver: its observations, its sky, its reference orbit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.files.text import FileError
from gnss_hil.flightsw.measurement import signals as flight_signals
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.config import Overrides

Choice = tuple[str, ...]
"""Signals that are played of a system's satellites."""


def _by_system(choices: Iterable[Choice]) -> dict[str, list[Choice]]:
    """Choices by system, in the order given."""
    found: dict[str, list[Choice]] = {}
    for choice in choices:
        found.setdefault(signals.SIGNALS[choice[0]].system, []).append(choice)
    return found


_NAME_OF = {signal.value: signal.name for signal in signals.SIGNALS.values()}

PAIRS = _by_system((_NAME_OF[first], _NAME_OF[second]) for first, second in flight_signals.PAIRS)
"""Signals of two frequencies by system, what the flight software prefers first."""

SINGLE = _by_system((name,) for name in signals.SIGNALS)
"""Single signals by system, the preferred one first."""

NEARLY = 0.9
"""A choice that has this share of the richest one's observations is as good as that."""


def override(document: dict[str, Any], overrides: Overrides) -> None:
    """Put observations and precise orbits into the caller's own document of a scenario."""
    played = [
        craft
        for craft in document.get("craft", [])
        if isinstance(craft, dict) and isinstance(craft.get("observations"), dict)
    ]
    if not played:
        _refuse(overrides)
        if overrides.sp3:
            document.setdefault("sky", {})["orbits"] = _paths(overrides.sp3)
        return
    sky = document.setdefault("sky", {})
    if overrides.sp3 and overrides.nav:
        # Messages have what precise orbits lack: group delays, health, GLONASS frequencies.
        sky |= {"orbits": _paths(overrides.sp3), "reports": "orbits"}
    elif overrides.sp3:
        sky.update(_reported(overrides.sp3))
    for craft in played:
        _craft(craft, sky, overrides)
    if overrides.obs:
        _time(document, played[0], overrides)


def _refuse(overrides: Overrides) -> None:
    for name in ("obs", "reference"):
        if getattr(overrides, name):
            raise Mistake(
                f"--{name}: no receiver is played in this scenario; use: gnss-hil run replay --obs FILE"
                f"{', or --emulator COMMAND' if name == 'reference' else ''}"
            )


def _reported(paths: Sequence[Path]) -> dict[str, Any]:
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


def _craft(craft: dict[str, Any], sky: dict[str, Any], overrides: Overrides) -> None:
    observations = craft["observations"]
    if overrides.obs:
        observations["file"] = str(overrides.obs.resolve())
    if not Path(observations.get("file", "")).is_file() and not overrides.obs:
        raise Mistake("replay: which observations? Give --obs FILE, and --sp3 or --nav for the satellites")
    if overrides.reference:
        observations["reference"] = {"oem": str(overrides.reference.resolve())}
    heard = [system.name for system in systems.tracked() if sky.get(system.name, "nominal") != "none"]
    if not heard:
        raise Mistake("replay: where are the satellites? Give --sp3 FILE or --nav FILE")
    if "signals" not in observations:
        observations["signals"] = _chosen(craft, heard, overrides.ionosphere_free)


def _chosen(craft: dict[str, Any], heard: Sequence[str], ionosphere_free: bool) -> list[str]:
    """Signals of the file for the systems that are heard: of each the first choice that has nearly as many
    observations as any. Mistake if there is none of any system."""
    from gnss_hil.emulator.assemble.recorded import signals_there

    path = craft["observations"]["file"]
    there = signals_there(path, craft.get("name", ""))
    found: list[str] = []
    for system in heard:
        choices = [c for c in (PAIRS if ionosphere_free else SINGLE)[system] if set(c) <= there.keys()]
        counts = [int(np.logical_and.reduce([there[name] for name in choice]).sum()) for choice in choices]
        richest = max(counts, default=0)
        if richest:
            found += next(c for c, count in zip(choices, counts, strict=True) if count >= NEARLY * richest)
    if not found:
        what = "pair of pseudoranges of two frequencies" if ionosphere_free else "pseudorange"
        raise Mistake(f"{path}: no {what} of {' or '.join(heard)}, whose orbits are given")
    return found


def _time(document: dict[str, Any], craft: dict[str, Any], overrides: Overrides) -> None:
    """Start, length and step of the file, but for what the command line or the scenario says."""
    from gnss_hil.emulator.assemble.recorded import span_of

    found = span_of(craft["observations"]["file"], craft.get("name", ""))
    given = {
        "duration_s": overrides.duration_s,
        "epoch_interval_s": overrides.interval_s,
        "orientation": document.get("time", {}).get("orientation"),
    }
    document["time"] = found | {name: value for name, value in given.items() if value is not None}
