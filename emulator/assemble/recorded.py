"""From a file of observations to a craft that can be played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites, systems
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.counts import noun, so_many
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import codec
from gnss_hil.emulator.assemble import recorded_remarks as remarks
from gnss_hil.emulator.assemble.shared import Shared
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.config.tables import Tell
from gnss_hil.emulator.constellation.sky import Sky
from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.emulator.files import rinex_obs
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.orbits.motion import read_trajectory
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.recorded import ground, inter_signal
from gnss_hil.emulator.receivers.recorded.observables import there
from gnss_hil.emulator.receivers.recorded.receiver import RecordedCraft, observed
from gnss_hil.emulator.receivers.recorded.reference import Reference, reference
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS, Signal
from gnss_hil.emulator.receivers.recorded.tracks import tracks
from gnss_hil.emulator.sensors import attitude
from gnss_hil.emulator.sensors.registry import SENSORS

NEAR = 0.1
"""A tag this share of an interval beside a run's epoch still is that epoch's."""

_SAMPLES = 5
"""Epochs by whose ranges the receiver's height is found."""

_QUARTER_NS = 900 * NS_PER_S

read = lru_cache(maxsize=2)(rinex_obs.read)


def observations(path: str, craft: str) -> rinex_obs.Observations:
    """The observations of a file; ScenarioError with one line if it has faults."""
    try:
        return read(Path(path))
    except FileError as error:
        raise ScenarioError(f"craft.{craft}.observations: {error}") from None


def span_of(path: str, craft: str) -> dict[str, object]:
    """[time] of a run that plays all of a file: its start, length and commonest step."""
    t_ns = observations(path, craft).t_ns
    if len(t_ns) < 2:
        raise ScenarioError(
            f"craft.{craft}.observations: {path}: {so_many(len(t_ns), 'epoch')}; two at least are played"
        )
    step_ns = _commonest_step_ns(t_ns)
    return {
        "start_gps": gpstime.to_calendar(int(t_ns[0])),
        "duration_s": (int(t_ns[-1] - t_ns[0]) + step_ns) / NS_PER_S,
        "epoch_interval_s": step_ns / NS_PER_S,
    }


def signals_there(path: str, craft: str) -> dict[str, Bool]:
    """Name of a signal that can be played -> whether each satellite and epoch of a file (p,) has it."""
    file = observations(path, craft)
    return {name: there(file, signal) for name, signal in SIGNALS.items()}


def _commonest_step_ns(t_ns: I64) -> int:
    """Of epochs (e,), two at least [ns]."""
    steps, counts = np.unique(np.diff(t_ns), return_counts=True)
    return int(steps[np.argmax(counts)])


def build_recorded(shared: Shared, craft: scenario.Craft, vehicle: Vehicle) -> RecordedCraft:
    """The craft of a scenario whose observations are played; ScenarioError if they cannot be."""
    time, settings, key = shared.given.time, craft.observations, f"craft.{craft.name}.observations"
    assert settings is not None, "this kind of receivers is built of them"
    file = observations(settings.file, craft.name)
    _refuse(shared.given.sky, craft, vehicle)
    epoch_of = _epoch_of(file, time, f"{key}: {settings.file}")
    marks_ns = _marks_ns(file, time, epoch_of)
    inside = (file.t_ns >= marks_ns[0]) & (file.t_ns <= marks_ns[-1])
    if (epoch_of[inside] < 0).any():
        shared.tell(
            f"{key}: {settings.file}: {np.count_nonzero(epoch_of[inside] < 0)} of {np.count_nonzero(inside)} "
            f"epochs are left out: beside the run's, which are {time.epoch_interval_s:g} s apart"
        )
    chosen = [SIGNALS[name] for name in settings.signals]
    frequencies = _frequencies(file, shared.sky, marks_ns, chosen)
    played = tracks(file, chosen, epoch_of, int(vehicle.channels[0]), frequencies)
    inter_signal_m = _inter_signal_m(shared)
    precise = shared.given.sky.reports == "orbits"
    for remark in (
        *remarks.left_out(file, played),
        *remarks.unused(file, epoch_of, chosen),
        *remarks.unknown(file.sat[epoch_of[file.epoch] >= 0], chosen, shared.sky),
        *remarks.lacking_delays(settings.signals, shared.sky, marks_ns, precise, inter_signal_m),
    ):
        shared.tell(f"{craft.name}: {remark}")
    contract = codec.codec(vehicle.antennas)
    found = RecordedCraft(
        name=craft.name,
        vehicle=vehicle,
        orbit=_reference(settings, marks_ns, shared.measured, f"{key}.reference", shared.tell),
        frequency=_by_index(frequencies),
        inter_signal_m=inter_signal_m,
        tracks=played,
        bounds=np.searchsorted(played.epoch, np.arange(time.epochs + 1)),
        marks_ns=marks_ns,
        epochs_per_pass=max(1, round(craft.receivers.almanac_cycle_s / time.epoch_interval_s)),
        codec=contract,
        templates=frames.frame_templates(contract, vehicle.antennas, [attitude.ROW.node], shared.ionosphere),
        sky=shared.sky,
        almanac=shared.almanac,
        row_of=shared.row_of,
        session=shared.session,
        of_one_carrier=_of_one_carrier(settings.signals),
    )
    _refuse_ground(found, f"{key}: {settings.file}")
    return found


def _inter_signal_m(shared: Shared) -> F64:
    """What the scenario's navigation files say of single signals, see `inter_signal.of_files`."""
    source = shared.given.sky.sources()[systems.reference().name]
    if source in ("nominal", "none") or not shared.sky.messages.any():
        return inter_signal.unknown()
    names = [source] if isinstance(source, str) else source
    try:
        return inter_signal.of_files([shared.open_path(name) for name in names])
    except FileError as error:
        raise ScenarioError(f"sky.{systems.reference().name}: {error}") from None


def _refuse_ground(craft: RecordedCraft, origin: str) -> None:
    """ScenarioError if the receiver was in the atmosphere, by its ranges at some epochs."""
    full = np.flatnonzero(np.diff(craft.bounds) >= ground.ENOUGH)
    some = np.unique(full[np.linspace(0, len(full) - 1, min(len(full), _SAMPLES)).astype(np.int64)])
    skies = ((epoch, craft.sky.at(int(craft.marks_ns[epoch]))) for epoch in some.tolist())
    height_m = ground.median_height_m(observed(craft, sky, craft.row_of, epoch) for epoch, sky in skies)
    if height_m < ground.LOWEST_M:
        raise ScenarioError(
            f"{origin}: the receiver is {height_m / 1e3:.1f} km above the ellipsoid by its own ranges: there "
            "is no model of the troposphere here, without which fixes on the ground are some 18 m too high; "
            f"played are receivers above {ground.LOWEST_M / 1e3:g} km"
        )


def _of_one_carrier(signals: Sequence[str]) -> Bool:
    """(8,) by system: whether all signals that are played are of one band."""
    bands = {(SIGNALS[name].system, SIGNALS[name].carrier_hz) for name in signals}
    return np.array([sum(system == value for system, _ in bands) == 1 for value in range(systems.COUNT)])


def _refuse(sky: scenario.Sky, craft: scenario.Craft, vehicle: Vehicle) -> None:
    """ScenarioError if the scenario demands something of a real receiver that only an emulated one can do."""
    if vehicle.antennas != 1:
        raise ScenarioError(
            f"craft.{craft.name}: vehicle '{vehicle.name}' has {so_many(vehicle.antennas, 'antenna')}; "
            "a file is of one"
        )
    keys = [f"sky.factors.{name}" for name in sky.factors.on() if FACTORS[name].acts_on == "receiver"]
    own = [f"factors.{name}" for name in craft.factors.on() if not FACTORS[name].default]
    own += ["structure"] if craft.structure else []
    own += [f"sensors.{name}" for name, row in SENSORS.items() if (name in craft.sensors.on()) != row.default]
    keys += [f"craft.{craft.name}.{key}" for key in own]
    if keys:
        raise ScenarioError(
            f"{keys[0]}: acts on emulated receivers; that of craft '{craft.name}' is real and played"
        )


def _epoch_of(file: rinex_obs.Observations, time: scenario.Time, origin: str) -> I64:
    """(e,) number of the run's epoch for each of the file's, -1 for one that is left out."""
    step_ns = _commonest_step_ns(file.t_ns) if len(file.t_ns) > 1 else time.interval_ns
    if abs(time.interval_ns / step_ns - 1) > NEAR:
        raise ScenarioError(
            f"{origin} has an epoch every {step_ns / NS_PER_S:g} s; "
            f"epoch_interval_s is {time.epoch_interval_s:g}"
        )
    since_ns = file.t_ns - time.start_ns
    number = np.rint(since_ns / time.interval_ns).astype(np.int64)
    near = np.abs(since_ns - number * time.interval_ns) <= NEAR * time.interval_ns
    found = np.where((number >= 0) & (number < time.epochs) & near, number, -1)
    # Of two epochs near one instant the first is played.
    found[np.setdiff1d(np.arange(len(found)), np.unique(found, return_index=True)[1])] = -1
    if not (found >= 0).any():
        raise ScenarioError(f"{origin}: no epoch inside the run")
    return found


def _marks_ns(file: rinex_obs.Observations, time: scenario.Time, epoch_of: I64) -> I64:
    """(epochs,) tags of the file; where it has no epoch, the one it would have."""
    marks_ns = time.start_ns + np.arange(time.epochs) * time.interval_ns
    inside = epoch_of >= 0
    marks_ns[epoch_of[inside]] = file.t_ns[inside]
    return marks_ns


def _reference(
    settings: scenario.ObservationFile, marks_ns: I64, measured: Orientation | None, key: str, tell: Tell
) -> Reference | None:
    if settings.reference is None:
        return None
    span_ns = int(marks_ns[0]), int(marks_ns[-1])
    found = reference(read_trajectory(settings.reference, span_ns, measured, key, tell, whole=False))
    unknown = int(np.count_nonzero(~found.known(marks_ns)))
    if unknown:
        first, last = (gpstime.iso(t_ns) for t_ns in found.flown.span_ns)
        tell(
            f"{key}: states from {first} to {last} GPS: {unknown} of {len(marks_ns)} epochs "
            f"{noun(unknown, 'is', 'are')} judged by nothing"
        )
    return found


def _frequencies(
    file: rinex_obs.Observations, sky: Sky, marks_ns: I64, signals: Sequence[Signal]
) -> dict[int, int]:
    """Slot -> frequency number of GLONASS satellites: by the file's header, else by their messages.

    ScenarioError if a satellite above that was observed has neither, and a signal needs it.
    """
    found = _broadcast_frequencies(sky, marks_ns) | dict(file.header.frequencies)
    needing = [signal for signal in signals if signal.spacing_hz]
    seen, above = np.unique(file.sat), set(sky.index.tolist())
    for signal in needing:
        mine = seen[satellites.system_of(seen) == signal.system]
        missing = [
            number
            for index, number in zip(mine.tolist(), satellites.number_of(mine).tolist(), strict=True)
            if index in above and number not in found
        ]
        if missing:
            raise ScenarioError(
                f"{file.origin}: neither GLONASS SLOT / FRQ # nor navigation messages (--nav FILE) have the "
                f"frequency of R{missing[0]:02d}; {signal.name} needs it"
            )
    return found


def _broadcast_frequencies(sky: Sky, marks_ns: I64) -> dict[int, int]:
    """Slot -> frequency number of the GLONASS satellites that send messages in the run."""
    found: dict[int, int] = {}
    glonass = np.flatnonzero(sky.messages & (satellites.system_of(sky.index) == satellites.GLONASS))
    if len(glonass):
        # A satellite keeps its frequency for months: an ephemeris every quarter of an hour tells of all.
        instants = np.unique(np.append(np.arange(marks_ns[0], marks_ns[-1], _QUARTER_NS), marks_ns[-1]))
        for t_ns in instants.tolist():
            broadcast = sky.at(t_ns).broadcast
            there = glonass[broadcast.available[glonass]]
            numbers = satellites.number_of(sky.index[there]).tolist()
            found |= dict(zip(numbers, broadcast.frequency[there].tolist(), strict=True))
    return found


def _by_index(frequencies: Mapping[int, int]) -> I64:
    """(SATELLITES,) GLONASS frequency numbers, 0 where none is known."""
    frequency = np.zeros(satellites.SATELLITES, np.int64)
    for slot, k in frequencies.items():
        frequency[satellites.index(satellites.GLONASS, slot)] = k
    return frequency
