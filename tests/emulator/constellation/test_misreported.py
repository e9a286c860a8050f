"""Messages that are off: read back by the user algorithms, they err as the model of orbits has it."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.constellation.broadcast import glonass, gps
from gnss_hil.emulator.constellation.nominal import nominal_glonass, nominal_gps
from gnss_hil.emulator.constellation.nominal_messages import Stretch
from gnss_hil.emulator.constellation.registry import records_of
from gnss_hil.emulator.error_models import ephemeris_error
from gnss_hil.emulator.error_models.ephemeris_error import EphemerisError

pytestmark = pytest.mark.verifies(
    "emulator/constellation/misreported.py",
    what="Messages of nominal satellites with errors of orbit and clock",
    by="free motion by Hill's equations: 1 cm over a GPS message's four hours, 1 mm over one of GLONASS",
    status="validated",
)

START_NS = gpstime.from_calendar(datetime(2012, 10, 31))
SEED = 4
CLOCK_M = 2.0
READ = {"gps": gps.from_records, "glonass": lambda made: glonass.from_records(made, np.zeros(len(made)))}


def errors_of(sky):
    """Errors of orbits, and of clocks that grow by a metre a minute from CLOCK_M at midnight on."""

    def errors(middles_ns, nodes_s, pos_m, vel_mps):
        place = ephemeris_error.errors(EphemerisError(), SEED, sky.index, middles_ns, nodes_s, pos_m, vel_mps)
        age_s = ((middles_ns - START_NS) / 1e9)[:, None, None] + nodes_s[:, None]
        return place, CLOCK_M + age_s / 60 + np.zeros(place.shape[:3])

    return errors


def off_m(system, nominal, reference_ns: int, nodes_s: np.ndarray):
    """Positions and clocks of the message of one reference time less those of the message without errors,
    read back, and what the errors say; (k, n, 3), (k, n), (k, n, 3)."""
    sky = nominal(START_NS)
    around = Stretch(reference_ns, reference_ns)
    plain, wrong = (records_of(system, sky, around, errors=errors) for errors in ((), (errors_of(sky),)))
    (place, clock, _), (near, late, _) = (
        READ[system](made).sample(np.array([reference_ns]), nodes_s) for made in (plain, wrong)
    )
    middle_ns = reference_ns // (60 * 10**9) * 60 * 10**9 + 30 * 10**9
    since_s = nodes_s + (reference_ns - middle_ns) / 1e9
    true_m, _, _ = sky.sample(np.array([middle_ns]), since_s)
    vel_mps = (sky.sample(np.array([middle_ns]), since_s + 0.5)[0] - true_m) * 2
    wanted, _ = errors_of(sky)(np.array([middle_ns]), since_s, true_m, vel_mps)
    return (near - place)[0], (late - clock)[0], wanted[0]


@pytest.mark.parametrize(
    ("system", "nominal", "reference_s", "half_s", "limit_m"),
    [("gps", nominal_gps, 7200, 7200, 0.01), ("glonass", nominal_glonass, 16 + 900, 900, 0.001)],
)
def test_a_message_errs_as_the_free_orbit_does_from_begin_to_end(
    system, nominal, reference_s, half_s, limit_m
):
    reference_ns = START_NS + reference_s * 10**9
    place, clock, wanted = off_m(system, nominal, reference_ns, np.linspace(-half_s, half_s, 9))
    assert np.abs(wanted).max() > 1
    assert np.abs(place - wanted).max() < limit_m
    assert np.abs(clock - (CLOCK_M + reference_s / 60)).max() < 1e-3


def test_angles_stay_within_half_a_turn():
    sky = nominal_gps(START_NS)
    made = records_of("gps", sky, Stretch(START_NS, START_NS + 86400 * 10**9), errors=(errors_of(sky),))
    for name in ("m0", "omega", "omega0"):
        assert np.abs(made.fields[name]).max() <= np.pi, name


def test_messages_of_files_stay_what_they_are():
    sky = nominal_gps(START_NS)
    around = Stretch(START_NS, START_NS)
    of_file = gps.from_records(records_of("gps", sky, around))
    same = records_of("gps", of_file, around, errors=(errors_of(sky),))
    assert np.array_equal(same.fields["e"], np.zeros(len(same)))
