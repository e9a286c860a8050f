"""Worlds have what their scenarios say; those that cannot be are refused in one line."""

import numpy as np
import pytest

from gnss_hil.emulator.config import named_files
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.error_models.base import Epochs
from tests.support import emulated

pytestmark = [
    pytest.mark.verifies(what="Scenario files"),
    pytest.mark.verifies(
        "emulator/orbits/motion.py",
        "emulator/attitude/turning.py",
        "emulator/config/named_files.py",
        what="Motion of a craft, files a scenario names",
        by="choice of the reader",
        status="modelled",
    ),
]


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        (
            {"clock": {"amplitude_ms": 10, "period_s": 60}},
            r"craft\.soyuz\.clock: .*drifts by up to 31\d{4} m/s",
        ),
        (
            {"attitude": {"mode": "slew", "profile": [{"t_s": 0}, {"t_s": 10, "roll_deg": 90}]}},
            r"craft\.soyuz\.attitude\.profile: the turn from 0 s to 10 s reaches 16\.9 deg/s; allowed 6\.9",
        ),
        ({"orbit": {"altitude_km": 415, "eccentricity": 0.1, "inclination_deg": 50}}, "perigee"),
        (
            {"orbit": {"semi_major_axis_km": 60000, "eccentricity": 0.85, "inclination_deg": 50}},
            "apogee at 104622 km; allowed is 101000 km and below",
        ),
    ],
)
def test_one_line_for_what_cannot_be(tables, says):
    with pytest.raises(ScenarioError, match=says) as refusal:
        emulated.world({**emulated.craft(), **tables})
    assert "\n" not in str(refusal.value)


def test_session_is_sixteen_bit():
    with pytest.raises(ScenarioError, match="session: 65536"):
        emulated.world(session=65536)


def test_no_satellites_at_all():
    with pytest.raises(ScenarioError, match="none"):
        emulated.world(sky={"gps": "none", "glonass": "none"})


def test_clocks_wander_as_far_and_as_fast_as_the_scenario_says():
    """0.1 ms to either side in 100 s: opposite after half a period, the same after a whole one."""
    craft = emulated.world(emulated.craft(clock={"amplitude_ms": 0.1, "period_s": 100})).craft[0]
    clock_s = craft.environment.clocks(Epochs(0, 101, 0, 10**9))[:, 0]
    assert clock_s[50:] == pytest.approx(-clock_s[:51], abs=1e-12)
    assert clock_s[100] == pytest.approx(clock_s[0], abs=1e-12)
    # Sampled every 3.6 deg, a sine's peak is missed by 5e-4 at most.
    assert np.abs(clock_s).max(axis=0) == pytest.approx(np.full(8, 1e-4), rel=5e-4)


def test_rays_that_pass_lower_than_the_scenario_says_are_hidden():
    """Of a craft at 415 km that is to see above 300 km: distances of straight rays from the Earth's centre,
    which differ by 21 km from those over its flattened surface."""
    world = emulated.world(sky={"ray_height_km": 300.0})
    block = world.craft[0].prepared(0)[0].block
    craft_m, satellites_m = block.geometry.state.pos_ecef_m[0], block.geometry.sky.pos_ecef_m[0]
    rays = satellites_m - craft_m
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    below = rays @ craft_m < 0
    nearest_m = np.linalg.norm(np.cross(rays, craft_m), axis=1)
    seen = block.in_sight[0]
    assert seen[~below].all() and (~below).any()
    assert not seen[below & (nearest_m < 6_356.7e3 + 299e3)].any()
    assert seen[below & (nearest_m > 6_378.2e3 + 301e3)].all()


def test_marks_name_the_clock_that_showed_them():
    """Table MarkClock of the contract: 0 is GPS time, 1 is domain 0."""
    for domain, named in ((None, 0), (0, 1)):
        clock = {} if domain is None else {"mark_domain": domain}
        _, (block,), _ = emulated.run(emulated.world(emulated.craft(clock=clock)), 1)
        assert emulated.decode(block, "TIME_FINE")["mark_clock"].tolist() == [named]


ELEMENTS = """CRAFT
1 99001U 12001A   12035.00000000  .00002000  00000-0  40000-4 0  9994
2 99001  51.6000 100.0000 0005000  90.0000  10.0000 15.50000000  1001
"""


@pytest.mark.parametrize(("day", "days"), [(4, None), (5, "1.0"), (9, "5.0"), (1, "3.0")])
def test_old_elements_are_told(tmp_path, day, days):
    """Their epoch is 4 February 2012, and the run's first instant 00:15 GPS."""
    file = tmp_path / "craft.tle"
    file.write_text(ELEMENTS)
    craft = {k: v for k, v in emulated.craft().items() if k != "orbit"}
    time = {"start_gps": f"2012-02-{day:02d}T00:00:15", "duration_s": 20}
    world = emulated.world({**craft, "trajectory": {"tle": str(file)}}, time=time)
    expected = (
        f"craft.soyuz.trajectory: {file}: elements of epoch 2012-02-04T00:00:15, {days} days from the run"
    )
    assert [line[: len(expected)] for line in world.remarks] == ([expected] if days else [])


@pytest.mark.parametrize("data", [None, "elsewhere"])
def test_a_file_that_is_nowhere_is_told_with_where_it_may_be(tmp_path, monkeypatch, data):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "there.n").touch()
    monkeypatch.delenv(named_files.DATA, raising=False)
    if data:
        monkeypatch.setenv(named_files.DATA, str(tmp_path / data))
    document = {
        "time": {"orientation": "/nowhere/finals"},
        "sky": {"gps": ["there.n", "no/brdc.n"], "glonass": "nominal"},
        "craft": [{"trajectory": {"oem": "no.oem"}, "structure": "iss"}],
    }
    missing = named_files.anchor(document, tmp_path)
    with pytest.raises(ScenarioError) as refusal:
        named_files.refuse_missing(document, missing)
    behind = "; GNSS_HIL_DATA, the folder of real data where {} may be, is not set"
    if data:
        behind = f", nor {{}} in GNSS_HIL_DATA ({tmp_path / 'elsewhere'})"
    named = (("sky.gps", "there.n"), ("sky.gps", "no/brdc.n"), ("craft.trajectory.oem", "no.oem"))
    lines = [
        f"{key}: {tmp_path / name}: No such file or directory{behind.format(name)}" for key, name in named
    ]
    expected = ["time.orientation: /nowhere/finals: No such file or directory", *lines[bool(data) :]]
    assert str(refusal.value).splitlines() == expected
    document["sky"]["gps"], document["time"], document["craft"] = "nominal", {}, []
    named_files.refuse_missing(document, missing)
