"""RINEX files of a run: each antenna's observations, those of the centre of mass, and the navigation file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.emulator.config.scenario import Scenario, ScenarioError
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export import navigation, rinex_obs, satellite_orbits, sp3
from gnss_hil.tools.export.reduce import distinct, one_clock, reduced
from gnss_hil.tools.export.rinex_obs import Observer
from gnss_hil.tools.export.run_data import CraftData

NAVIGATION, SATELLITES = "broadcast.nav", "satellites.sp3"
_STRANGE_M = 100.0
"""Satellites farther from the navigation file than this are another sky's: the file would mislead."""
_DIFFERS_M = 0.2

_RAW = "Raw observations of one antenna of a spacecraft, decoded from its bus."
_REDUCED = """All antennas' observations, reduced to the spacecraft's centre of mass by attitude and lever
arms on the bus, and lines of sight from its fix."""
_SHAPIRO = {
    True: " The relativistic delay of the path is in, as measured.",
    False: " The relativistic delay of the path (Shapiro, 12 to 19 mm) is taken out.",
}


@dataclass(frozen=True, slots=True)
class Choices:
    """What a command line may choose: the Shapiro delay left in the reduced file, GLONASS states in WGS-84,
    a navigation file at all."""

    shapiro: bool = False
    wgs84: bool = True
    navigation: bool = True


@dataclass(frozen=True, slots=True)
class File:
    """A file to be written, and a remark on it of one line."""

    name: str
    text: Iterator[str]
    remark: str = ""


def files_of(scenario: Scenario, data: Sequence[CraftData], choices: Choices) -> tuple[list[File], list[str]]:
    """The files of a run, and remarks on what could not be made or differs."""
    files: list[File] = []
    remarks: list[str] = []
    for craft in data:
        files += _antennas(craft)
        _add_reduced(craft, choices.shapiro, files, remarks)
    if not files:
        raise Mistake("no receiver measured anything; there is nothing to write")
    if choices.navigation:
        _add_satellites(scenario, data, choices.wgs84, files, remarks)
    return files, remarks


def _antennas(craft: CraftData) -> list[File]:
    files = []
    rows = craft.rows
    tagged = craft.tagged
    for a, antenna in enumerate(craft.vehicle.names):
        mine = distinct(rows[tagged & (rows.receiver == a)])
        if not len(mine):
            continue
        observer = Observer(
            f"RX{a + 1}", antenna, tuple(craft.vehicle.lever_arm_body_m[a]),
            tuple(craft.vehicle.boresight_body[a]), _RAW,
        )  # fmt: skip
        name = f"{craft.name}_{antenna.replace(' ', '_')}.obs"
        epochs = len(np.unique(mine.epoch))
        files.append(File(name, rinex_obs.text_of(craft, mine, observer), so_many(epochs, "epoch")))
    return files


def _add_reduced(craft: CraftData, shapiro: bool, files: list[File], remarks: list[str]) -> None:
    if not one_clock(craft):
        remarks.append(
            f"craft {craft.name}: its receivers have several clocks, one file of the centre of mass has one: "
            "only the antennas' files are written"
        )
        return
    found = reduced(craft, shapiro)
    if not len(found.rows):
        remarks.append(
            f"craft {craft.name}: no epoch with fix and attitude: nothing is reduced to its centre of mass"
        )
        return
    observer = Observer("all", "centre of mass", (0.0, 0.0, 0.0), None, _REDUCED + _SHAPIRO[shapiro])
    epochs = len(np.unique(found.rows.epoch))
    remark = f"{so_many(epochs, 'epoch')}, centre of mass; left out: "
    remark += f"{so_many(found.unplaced, 'epoch')} without fix or attitude, "
    remark += f"{so_many(found.repeated, 'measurement')} of satellites measured twice"
    files.append(File(f"{craft.name}.obs", rinex_obs.text_of(craft, found.rows, observer), remark))


def _add_satellites(
    scenario: Scenario, data: Sequence[CraftData], wgs84: bool, files: list[File], remarks: list[str]
) -> None:
    """The navigation file and the satellites' orbits."""
    span_ns = navigation.span_ns(data)
    try:
        sky = navigation.constellations(scenario)
        errors = navigation.errors_of(scenario, sky)
    except ScenarioError as error:
        remarks.append(f"no {NAVIGATION}, no {SATELLITES}: {error}")
        return
    orbits = satellite_orbits.antennas(sky, span_ns)
    table = File(SATELLITES, sp3.text_of(orbits), so_many(len(orbits.names), "satellite"))
    plain = navigation.messages(sky, span_ns, True, errors)
    written = plain if wgs84 else navigation.messages(sky, span_ns, False, errors)
    missing = navigation.without_messages(sky, plain)
    if not plain:
        remarks.append(f"no {NAVIGATION}: {missing}")
        files.append(table)
        return
    compared = {craft.name: navigation.disagreement_m(plain, craft) for craft in data}
    apart_m = {name: value for name, value in compared.items() if value is not None}
    worst_m = max(apart_m.values(), default=0.0)
    where = f"satellites on the bus of {max(apart_m, key=lambda name: apart_m[name])}" if apart_m else ""
    if worst_m > _STRANGE_M:
        remarks.append(
            f"no {NAVIGATION}, no {SATELLITES}: {where} are {worst_m:.3g} m (median) from those of the "
            "scenario's sky; the emulator that flew them has their messages"
        )
        return
    if worst_m > _DIFFERS_M:
        remarks.append(
            f"{where} are {worst_m:.3g} m (median) from the navigation file: error factors of the sky"
        )
    if missing:
        remarks.append(f"{NAVIGATION} is without {missing}")
    count = sum(len(rows) for rows in written.values())
    text = navigation.text_of(written, int(data[0].t_ns[0]), wgs84)
    remark = f"{so_many(count, 'record')}, {1e3 * worst_m:.1f} mm (median) from the bus"
    files.append(File(NAVIGATION, text, remark))
    files.append(table)
