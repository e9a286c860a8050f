"""A craft's structure in a scene: what it hides, and what its reflections do to the channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.error_models.base import Factor
from gnss_hil.emulator.error_models.params_structure import Multipath
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.signal import antenna_patterns, multipath_engine
from gnss_hil.emulator.signal.bands import BY_SYSTEM
from gnss_hil.emulator.signal.geometry import Array, Motion, angle_rad, spin
from gnss_hil.emulator.signal.multipath_engine import Pose, Reception
from gnss_hil.emulator.signal.structure import file
from gnss_hil.emulator.signal.structure.bodies import Structure, require_outside, structure
from gnss_hil.emulator.signal.structure.shadowing import blocked
from gnss_hil.emulator.signal.visibility import View

NAMES = ("shadowing", "multipath")
"""The factors that need a structure."""

Numbers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """What does not change of a craft's surroundings.

    shadows         whether anything is hidden
    multipath       None: nothing is reflected
    spacing_chips   of the correlators, early to late
    antennas        their right-handed gain
    """

    shape: Structure
    shadows: bool
    multipath: Multipath | None
    spacing_chips: float
    vehicle: Vehicle
    antennas: antenna_patterns.Receive


@dataclass(frozen=True, slots=True, eq=False)
class Around:
    """A hull at one instant: pose, and (m, n) satellites hidden from antennas."""

    hull: Hull
    pose: Pose
    hidden: NDArray[np.bool_]


def build_hull(
    craft: scenario.Craft, factors: Mapping[str, Factor], vehicle: Vehicle, antennas: antenna_patterns.Receive
) -> Hull | None:
    """The surroundings of a craft, None if no factor asks for them; ScenarioError if they cannot be had."""
    wanted = [factor for factor in NAMES if factor in factors]
    if not wanted:
        return None
    if craft.structure is None:
        raise ScenarioError(
            f"craft.{craft.name}.factors.{wanted[0]}: needs the craft's structure; name it: structure = "
            f'"FILE", shipped are {", ".join(file.shipped())}'
        )
    try:
        shape = structure(file.load(file.find(craft.structure)))
        require_outside(shape, dict(zip(vehicle.names, vehicle.lever_arm_body_m, strict=True)))
    except file.StructureError as error:
        raise ScenarioError(f"craft.{craft.name}.structure: {error}") from None
    spacing_chips = craft.receivers.loops.correlator_spacing_chips
    return Hull(shape, "shadowing" in factors, factors.get("multipath"), spacing_chips, vehicle, antennas)


def around(
    hull: Hull,
    view: View,
    motion: Motion,
    state: CraftState,
    dcm: Array,
    rate_rps: Array,
    sun_m: Array,
    t_s: float,
) -> Around:
    """A hull in a scene.

    motion   of the satellites, inertial;  dcm (3, 3) body from ECEF;  rate_rps (3,) of the craft
    sun_m    (3,) place of the Sun in ECEF;  t_s since the start of the run
    """
    los_body = view.los_ecef @ dcm.T
    craft_mps = state.vel_ecef_mps + spin(state.pos_ecef_m)
    turn = multipath_engine.los_rate_body(
        los_body, (motion.vel_mps - craft_mps) @ dcm.T, view.distance_m, rate_rps
    )
    sun = dcm @ (sun_m - state.pos_ecef_m)
    pose = multipath_engine.pose(hull.shape, los_body, turn, sun / np.sqrt(sun @ sun), rate_rps, t_s)
    shape = (len(hull.vehicle.names), len(los_body))
    hidden = (
        blocked(pose.bodies, hull.vehicle.lever_arm_body_m, los_body)
        if hull.shadows
        else np.zeros(shape, bool)
    )
    return Around(hull, pose, hidden)


def receive(
    at: Around, antenna: Numbers, satellite: Numbers, system: Numbers, wave_m: Array
) -> Reception | None:
    """What channels (p,) receive; None if nothing is reflected."""
    hull = at.hull
    if hull.multipath is None:
        return None
    boresight = hull.vehicle.boresight_body

    def gain_dbi(rows: Numbers, towards: Array) -> Array:
        angle = angle_rad(boresight[rows], towards)
        return antenna_patterns.look_up(hull.antennas.right_dbi, hull.antennas.row[rows], angle)

    chip_m = BY_SYSTEM.chip_m[system]
    direct = (~at.hidden[antenna, satellite]).astype(float)
    return multipath_engine.receive(
        hull.shape, hull.multipath, hull.spacing_chips, at.pose, hull.vehicle.lever_arm_body_m, antenna,
        satellite, direct, wave_m, chip_m, gain_dbi,
    )  # fmt: skip


def heard(at: Around, cn0_dbhz: Array, candidate: NDArray[np.bool_], system: Numbers, wave_m: Array) -> Array:
    """C/N0 (m, n) with the hull in the way.

    candidate   (m, n) would be heard without it;  system, wave_m (n,) of the satellites
    A hidden satellite may be heard by its reflection, if receivers hold such a lock; else not at all. What
    reflections take from or give to a direct ray changes the C/N0 told, but not who is held (modelled).
    """
    hidden = candidate & at.hidden
    if not hidden.any():
        return cn0_dbhz
    cn0 = np.where(hidden, -np.inf, cn0_dbhz)
    multipath = at.hull.multipath
    if multipath is not None and multipath.hold_reflections:
        antenna, satellite = np.nonzero(hidden)
        reception = receive(at, antenna, satellite, system[satellite], wave_m[satellite])
        cn0[antenna, satellite] = cn0_dbhz[antenna, satellite] + reception.level_db
    return cn0
