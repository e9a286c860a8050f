"""What the unit's almanac makes of the frames: only what it has, its health, its age."""

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from tests.emulator.files.test_almanacs import AGL, YUMA
from tests.support import emulated

pytestmark = pytest.mark.verifies(what="Blocks of frames, almanac")


def world(*names):
    given = scenario.parse(emulated.document(sky={"almanac": list(names)}), "test")
    return assemble.build_world(given, [emulated.VEHICLE], 7)


@pytest.fixture
def files(tmp_path):
    """G01 of 2016, unhealthy, R01 of 2011: the run of October 2012 is between, years from both."""
    (tmp_path / "gps.alm").write_text(YUMA.replace("Health:                     000", "Health: 063"))
    (tmp_path / "glonass.agl").write_text(AGL)
    return str(tmp_path / "gps.alm"), str(tmp_path / "glonass.agl")


def test_only_what_is_in_the_almanac_is_sent(files):
    _, blocks, _ = emulated.run(world(*files), 20)
    z = [emulated.decode(block, "ALM_Z") for block in blocks]
    sent = {
        (int(system), int(number)): (int(health), int(age))
        for part in z
        for system, number, health, age in zip(
            part["sat_system"], part["sat_number"], part["health"], part["age_h"], strict=True
        )
    }
    assert sent == {(satellites.GPS, 1): (1, 255), (satellites.GLONASS, 1): (0, 255)}
    assert all(emulated.decode(block, "STATUS")["almanac_satellites"].tolist() == [2] * 4 for block in blocks)


def test_almanacs_choose_no_satellites_for_receivers_that_search_alone(files):
    """What is measured stays what it was: bit for bit but for almanac and status."""
    _, with_it, _ = emulated.run(world(*files), 5)
    _, without, _ = emulated.run(emulated.world(), 5)
    for one, other in zip(with_it, without, strict=True):
        a, b = emulated.channels(one), emulated.channels(other)
        assert len(a["sat"])
        assert all(np.array_equal(a[name], b[name]) for name in a)


def test_age_is_counted_in_hours(tmp_path):
    start_ns = gpstime.from_calendar(scenario.parse(emulated.document(), "test").time.start_gps)
    week, second, _ = gpstime.week_second_ns(start_ns - 100 * 3600 * gpstime.NS_PER_S - 1)
    text = YUMA.replace("589824.0000", f"{second}.0").replace("866", str(week % 1024))
    (tmp_path / "new.alm").write_text(text)
    _, blocks, _ = emulated.run(world(str(tmp_path / "new.alm")), 20)
    ages = [age for block in blocks for age in emulated.decode(block, "ALM_Z")["age_h"].tolist()]
    assert ages == [100]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "No such file"),
        ("\n", "file is empty"),
        (YUMA.replace("5153.602051", "?"), "line 8: SQRT(A) is '?'"),
        (YUMA.replace(" 01\n", " 63\n"), "no satellite of the sky is in it"),
    ],
)
def test_a_bad_almanac_ends_the_run_in_one_line(tmp_path, text, message):
    path = tmp_path / "bad.alm"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ScenarioError, match=r"^sky\.almanac: ") as fault:
        world(str(path))
    assert message in str(fault.value)
    assert "\n" not in str(fault.value)
