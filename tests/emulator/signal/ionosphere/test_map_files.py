"""From a scenario's words to a field: what is given counts, what contradicts itself is refused."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest
from pydantic import ValidationError

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.error_models.ionosphere import Ionosphere, build_field, profile_of
from gnss_hil.emulator.files.ionex import TecMaps
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.signal.ionosphere.map_files import joined
from gnss_hil.emulator.signal.ionosphere.maps import vertical_tecu
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS

pytestmark = pytest.mark.verifies(what="Parameters of factors, their registry")

LAT = np.arange(80.0, -81, -20)
LON = np.arange(-180.0, 181, 20)


def maps(hours, values=None, day=1, lon=LON):
    epoch = tuple(datetime(2017, 1, day, hour) for hour in hours)
    if values is None:
        values = np.arange(len(hours), dtype=float)[:, None, None] + np.zeros((1, len(LAT), len(lon)))
    return TecMaps(epoch, LAT, lon, values, 450.0, 6371.0)


def at(hour, day=1):
    return gpstime.from_utc(datetime(2017, 1, day, hour))


def test_presets_and_what_is_said_in_their_place():
    assert profile_of(Ionosphere(activity="high")) == PRESETS["high"].profile
    found = profile_of(Ionosphere(peak_height_km=280, plasmasphere_share=0.2))
    assert (found.peak_m, found.plasmasphere_share) == (280e3, 0.2)
    assert found.topside_m == PRESETS["low"].profile.topside_m


def test_own_coefficients_count():
    """Night: 5 ns, which are 9.2 TECU on L1; alpha0 adds to them at 14 h."""
    field = build_field(Ionosphere(alpha=(2e-8, 0, 0, 0), beta=(1e5, 0, 0, 0)), [], (0, 0))
    lon = np.deg2rad(np.array([0.0, 180.0]))
    content = field.vertical_tecu(14 * 3_600_000_000_000, 0.0, np.zeros(2), lon)
    assert content == pytest.approx(
        np.array([25e-9, 5e-9]) * 299_792_458 * 1575.42e6**2 / 40.3082e16, rel=1e-5
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"model": "ionex"}, "name one or more"),
        ({"alpha": (0, 0, 0, 0)}, "belong together"),
        ({"alpha": (0, 0, 0, 0), "beta": (0, 0, 0, 0), "files": ("a",)}, "alpha and beta, or one"),
        ({"files": ("a", "b")}, "alpha and beta, or one"),
        ({"peak_height_km": 50}, "greater than or equal to 150"),
        ({"hmf2": 300}, "Extra inputs"),
    ],
)
def test_contradictions_are_refused(words, message):
    with pytest.raises(ValidationError, match=message):
        Ionosphere(**words)


def test_days_are_joined_and_the_later_file_counts():
    first = maps((0, 12), values=np.full((2, len(LAT), len(LON)), 5.0))
    second = maps((0, 12), values=np.full((2, len(LAT), len(LON)), 9.0), day=2)
    both = joined([first, second], "x", (at(1), at(3, day=2)))
    assert (both.count, both.interval_s) == (4, 43200.0)
    assert vertical_tecu(both, at(18), 0.0, np.array(0.2), np.array(0.1)) == pytest.approx(7.0)


@pytest.mark.parametrize(
    ("files", "span", "message"),
    [
        ([maps((0, 2))], (1, 3), "maps from 2017-01-01T00:00:18 to 2017-01-01T02:00:18; the run is from"),
        ([maps((0, 2, 5))], (1, 2), "not evenly spaced"),
        ([maps((0,))], (0, 0), "not evenly spaced"),
        ([maps((0, 2), lon=LON[3:])], (1, 2), "longitudes span 300 deg"),
        ([maps((0, 2)), maps((4, 6), lon=LON[3:])], (1, 2), "grids of the files differ"),
    ],
)
def test_maps_that_do_not_serve_are_refused(files, span, message):
    with pytest.raises(FileError, match=message) as error:
        joined(files, "a.17i, b.17i", tuple(at(hour) for hour in span))
    assert str(error.value).startswith("a.17i, b.17i: ")


def test_gaps_are_named_not_filled():
    values = np.ones((2, len(LAT), len(LON)))
    values[1, 2, 5] = np.nan
    with pytest.raises(FileError, match="02:00:18 has no value at latitude 40, longitude -80"):
        joined([maps((0, 2), values)], "x", (at(0), at(2)))


@pytest.mark.parametrize("value", [0.0, -0.1, 99.9, 999.0, 999.9])
def test_maps_of_nothing_but_what_stands_for_none_are_refused(value):
    some = np.arange(len(LAT) * len(LON), dtype=float).reshape(len(LAT), len(LON)) % 37
    none = np.full_like(some, value)
    for values in ((none, none), (some, none), (none, some)):
        with pytest.raises(FileError, match=f"has {value:g} TECU everywhere, which stands for none"):
            joined([maps((0, 12), values=np.stack(values))], "x", (at(1), at(2)))
    assert joined([maps((0, 12), values=np.stack((some, some)))], "x", (at(1), at(2)))
