"""What is told of a receiver that is played: observations that are left out, delays that no file has.

A line each, without a subject; nothing of it is a fault.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.counts import noun, so_many
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.constellation.base import Broadcast
from gnss_hil.emulator.constellation.sky import Sky
from gnss_hil.emulator.files import rinex_obs
from gnss_hil.emulator.receivers.recorded.signals import Signal
from gnss_hil.emulator.receivers.recorded.tracks import LOUDEST_DBHZ, Tracks


def left_out(file: rinex_obs.Observations, played: Tracks) -> Iterator[str]:
    """Observations that cannot be used."""
    if file.repeated:
        counts = ", ".join(f"{count} of {code}" for code, count in sorted(file.repeated.items()))
        yield (
            f"values that {rinex_obs.SAME} satellites of an epoch or more share stand for none, and are left "
            f"out: {counts}"
        )
    if played.dropped:
        yield (
            f"{played.dropped} of {played.dropped + len(played)} observations "
            f"{noun(played.dropped, 'is', 'are')} left out: alone in time, hence without a range rate, or "
            "without a channel"
        )
    if played.doubtful:
        yield (
            f"{played.doubtful} of {len(played)} signal strengths {noun(played.doubtful, 'is', 'are')} "
            f"left out: receivers measure more than 0 and no more than {LOUDEST_DBHZ:g} dBHz"
        )


def unused(file: rinex_obs.Observations, epoch_of: I64, played: Sequence[Signal]) -> Iterator[str]:
    """Satellites of systems that are not played, by letters of the systems.

    epoch_of  (e,) number of the run's epoch for each of the file's, -1 for one that is left out
    """
    counts = {letter: np.count_nonzero(epoch_of[epochs] >= 0) for letter, epochs in file.passed.items()}
    inside = satellites.system_of(file.sat)[epoch_of[file.epoch] >= 0]
    counts |= {system.letter: np.count_nonzero(inside == system.value) for system in SYSTEMS.values()}
    used = {system.letter for system in systems.tracked()}
    heard = {signal.system for signal in played}
    silent = {system.letter for system in systems.tracked() if system.value not in heard}
    for letters, why in (
        (sorted(counts.keys() - used), "not used by this bench"),
        (sorted(silent), "none of their signals is played"),
    ):
        present = [letter for letter in letters if counts[letter]]
        if present:
            number = int(sum(counts[letter] for letter in present))
            many = so_many(number, "observation is", "observations are")
            yield f"{', '.join(present)}: {many} left out: {why}"


def unknown(sat: I64, played: Sequence[Signal], sky: Sky) -> Iterator[str]:
    """Satellites of the signals' systems that were observed (p,) and of which nothing is known."""
    of_system = np.isin(satellites.system_of(sat), [signal.system for signal in played])
    found = np.setdiff1d(sat[of_system], sky.index)
    if len(found):
        yield f"{satellites.listed(found)} were observed, and are left out: the sky's files lack them"


def lacking_delays(
    names: Sequence[str], sky: Sky, marks_ns: I64, precise: bool, inter_signal_m: F64
) -> Iterator[str]:
    """Lines on what clocks of signals lack, by the sky at the begin, in the middle and at the end of a run.

    precise  satellites report precise clocks, which are those of ranges without ionosphere
    inter_signal_m   (16, SATELLITES) what civil messages say of signals, nan where nothing
    Source: IS-GPS-200, 20.3.3.3.3.2 (T_GD) and 30.3.3.3.1.1 (ISC); GLONASS ICD 5.1 (2008), 4.4
    """
    said = [sky.at(int(t_ns)).broadcast for t_ns in (marks_ns[0], marks_ns[len(marks_ns) // 2], marks_ns[-1])]
    for system in systems.tracked():
        mine = [signals.SIGNALS[name] for name in names if signals.SIGNALS[name].system == system.name]
        rows = np.flatnonzero(satellites.system_of(sky.index) == system.value)
        if not mine or not len(rows):
            continue
        of_pairs = precise or not sky.messages[rows].any()
        one_band = len({signal.carrier_hz for signal in mine}) == 1
        if _needs_delay(mine, of_pairs, one_band) and not _known_delay(said, rows):
            have = "precise clocks" if of_pairs else "messages"
            item = "T_GD" if system.reference else "Delta tau, RINEX 3.05 on"
            yield (
                f"{system.name}: {have} have no group delay between the carriers ({item}; --nav FILE): "
                f"ranges of {' and '.join(signal.name for signal in mine)} are off by some metres"
            )
        lacks = {s.name: sky.index[rows][np.isnan(inter_signal_m[s.value, sky.index[rows]])] for s in mine}
        apart = [signal for signal in mine if signal.clock_code and len(lacks[signal.name])]
        if apart:
            theirs = " and ".join(dict.fromkeys(signal.clock_code for signal in apart))
            ours = " and ".join(signal.name for signal in apart)
            number = len(lacks[apart[0].name])
            yield (
                f"{system.name}: clocks are those of {theirs}: how far from it a satellite sends {ours} "
                f"(ISC) no file says of {number} of {len(rows)} satellites; decimetres, metres in pairs "
                "and of L5"
            )


def _needs_delay(mine: Sequence[signals.Signal], of_pairs: bool, one_band: bool) -> bool:
    """Whether clocks of signals take the delay between the carriers: those of one carrier under clocks of
    two, and any whose delay is against the first, under clocks of that."""
    in_clock = any(signal.group_delay == "tgd" for signal in mine)
    later = any(signal.group_delay == "delta_tau" for signal in mine)
    return one_band if of_pairs or in_clock else later


def _known_delay(said: Sequence[Broadcast], rows: I64) -> bool:
    return any(np.any(each.group_delay_m[rows]) or np.any(each.band_delay_m[rows]) for each in said)
