"""The truth of a craft whose emulator is another's: a reference orbit, at the instants of its time marks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.counts import noun
from gnss_hil.emulator.config.scenario import Scenario, ScenarioError
from gnss_hil.emulator.config.tables import Tell, TrajectoryFile, untold
from gnss_hil.emulator.files import finals, oem
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.journal import TruthLog
from gnss_hil.emulator.orbits.motion import Flown, read_trajectory
from gnss_hil.emulator.truth import TRUTH as ROW
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.recording.run_folder import TRUTH, RunFolder

_UNKNOWN = ("position_ecef_m", "velocity_ecef_mps", "quaternion_body_from_ecef", "rate_body_rps", "clock_s")


def check(scenario: Scenario, path: Path) -> None:
    """Mistake, before anything runs, of what can be no reference of this scenario."""
    if len(scenario.craft) > 1:
        raise Mistake(f"--reference {path}: of which of {len(scenario.craft)} craft? It is for one")
    try:
        oem.read(path)
    except FileError as error:
        raise Mistake(f"--reference: {error}") from None


def refusal(scenario: Scenario, path: Path | None, first_ns: int) -> str:
    """Why a reference can judge no epoch of a run that begins at first_ns, GPS time; "" if it can, or if
    there is none."""
    time = scenario.time
    try:
        if path is not None:
            _orbit(scenario, path, (first_ns, first_ns + (time.epochs - 1) * time.interval_ns), untold)
    except (ScenarioError, FileError) as error:
        return str(error)
    return ""


def _orbit(scenario: Scenario, path: Path, span_ns: tuple[int, int], tell: Tell) -> Flown:
    """The reference over a run, or over a part of it."""
    named = scenario.time.orientation
    measured = finals.read(Path(named)) if named else None
    return read_trajectory(TrajectoryFile(oem=str(path)), span_ns, measured, "--reference", tell, whole=False)


def write_truth(
    folder: RunFolder, scenario: Scenario, path: Path, digest: Digest
) -> tuple[list[str], list[str]]:
    """The truth of a run, from its reference; why there is none, and remarks on it, in lines.

    Attitude and clocks are unknown; satellites in view are those that were measured.
    """
    timeline, remarks = digest.timeline, list[str]()
    t_ns, first = np.unique(timeline["t_ns"], return_index=True)
    if not len(t_ns):
        return [f"--reference {path}: no time mark was heard"], []
    try:
        orbit = _orbit(scenario, path, (int(t_ns[0]), int(t_ns[-1])), remarks.append)
    except (ScenarioError, FileError) as error:
        return [str(error)], []
    held = np.array([orbit.holds(t) for t in t_ns.tolist()])
    if unknown := int(np.count_nonzero(~held)):
        begin, end = map(gpstime.iso, orbit.span_ns)
        remarks.append(
            f"--reference: {path}: states from {begin} to {end} GPS: {unknown} of {len(t_ns)} epochs "
            f"{noun(unknown, 'is', 'are')} judged by nothing"
        )
    rows = np.zeros(int(held.sum()), ROW)
    for name in _UNKNOWN:
        rows[name] = np.nan
    state = orbit.over(t_ns[held])
    rows["t_gps_ns"] = t_ns[held]
    rows["position_ecef_m"], rows["velocity_ecef_mps"] = state.pos_ecef_m, state.vel_ecef_mps
    rows["satellites_visible"] = timeline["satellites_measured"][first][held]
    with TruthLog(folder / TRUTH, ROW, [scenario.craft[0].name]) as log:
        log.add(rows, 0.0)
    return [], remarks
