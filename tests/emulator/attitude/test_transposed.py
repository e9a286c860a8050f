"""Tables read the wrong way round: craft in a made-up orbit that keep the Earth or the Sun in its place."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.attitude.table import TabulatedAttitude
from gnss_hil.emulator.attitude.transposed import remark, wander_rad
from gnss_hil.emulator.config.tables import Attitude
from gnss_hil.emulator.earth import frames, sun_moon
from gnss_hil.emulator.files.csv_table import Table

pytestmark = pytest.mark.verifies(
    "emulator/attitude/transposed.py",
    what="Attitude tables of the other convention are told",
    by="craft that keep the Earth or the Sun in its place; how far is far is a rule of ours",
    status="modelled",
)

START_NS = 1_300_000_000 * gpstime.NS_PER_S
T_NS = START_NS + np.arange(0, 5601, 10) * gpstime.NS_PER_S
SPAN_NS = int(T_NS[0]), int(T_NS[-1])


def place_m(t_ns):
    """A circular orbit, inclined 53 deg, EME2000."""
    angle = 2 * np.pi * (t_ns - START_NS) / 5560e9
    return 6.79e6 * np.stack((np.cos(angle), 0.6 * np.sin(angle), 0.8 * np.sin(angle)), -1)


class Orbit:
    def over(self, t_ns):
        return SimpleNamespace(
            pos_ecef_m=np.einsum("nij,nj->ni", frames.ecef_from_eme2000(t_ns), place_m(t_ns))
        )


def facing(towards, beside):
    """Quaternions, scalar first, that turn from the body to EME2000: z along, y about across (k, 3)."""
    z = towards / np.linalg.norm(towards, axis=1)[:, None]
    y = np.cross(z, beside)
    y /= np.linalg.norm(y, axis=1)[:, None]
    eme2000_from_body = np.stack((np.cross(y, z), y, z), axis=2)
    return np.roll(Rotation.from_matrix(eme2000_from_body).as_quat(), 1, axis=1)


def craft(kind):
    nadir, sun = -place_m(T_NS), sun_moon.sun_gcrs_m(T_NS)
    if kind == "orbital":
        return facing(nadir, np.gradient(nadir, axis=0))
    if kind == "sun, spinning":
        spun = 2 * np.pi * np.arange(len(T_NS)) / 200
        beside = np.stack((np.cos(spun), np.sin(spun), 0.3 * np.ones(len(spun))), axis=1)
        return facing(sun, beside)
    return np.tile(np.roll(Rotation.from_rotvec((0.4, -1.0, 0.7)).as_quat(), 1), (len(T_NS), 1))


@pytest.mark.parametrize(
    ("kind", "named"), [("orbital", "the Earth's centre"), ("sun, spinning", "the Sun"), ("inertial", None)]
)
def test_only_the_other_convention_is_told(kind, named):
    """A craft that stands still among the stars looks the same either way: nothing is said of it."""
    table = Table(T_NS, craft(kind))
    right, wrong = (
        TabulatedAttitude(table, "x.csv", convention=name)
        for name in ("body_from_celestial", "celestial_from_body")
    )
    assert remark(right, Orbit(), SPAN_NS, None) is None
    told = remark(wrong, Orbit(), SPAN_NS, None)
    if named is None:
        assert told is None
    else:
        assert told is not None
        assert told.startswith(f"{named} wanders by ")
        assert told.endswith("with the quaternions read the other way round: is the convention right?")


def test_directions_without_a_middle_wander_most():
    assert wander_rad(np.array(((1.0, 0, 0), (-1.0, 0, 0)))) == pytest.approx(np.pi)
    assert wander_rad(np.array(((2.0, 0, 0), (5.0, 0, 0)))) == 0.0


def test_a_table_needs_its_convention():
    with pytest.raises(ValueError, match="mode 'table' takes convention = 'body_from_celestial' or 'cel"):
        Attitude(mode="table", file="x.csv")
    with pytest.raises(ValueError, match="and no other mode does"):
        Attitude(convention="body_from_celestial")
