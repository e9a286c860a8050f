"""The sky that ships as files flies as its README says, errs as it says, and is what the exporter writes."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.config.tables import Time
from gnss_hil.emulator.constellation import phase_centre
from gnss_hil.emulator.constellation.sources import from_files
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.earth.sun_moon import sun_ecef_m
from gnss_hil.emulator.error_models.ephemeris_error import orbital_axes
from gnss_hil.emulator.files import rinex_nav, sp3
from gnss_hil.tools.command_line.main import main
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "examples/sky",
    "tools/export/sky.py",
    "tools/export/satellite_orbits.py",
    what="A sky of our own in files: orbits, and messages that err",
    by=(
        "flown as its README says; the package sp3 reads the orbits, by which messages err as published "
        "(GPS 0.7 m, GLONASS 1.9 m); mean squared errors of fixes by their covariance 3.2"
    ),
    status="validated",
)

SKY = Path(__file__).parents[2] / "examples/sky"
README = (SKY / "README.md").read_text().replace("\\\n", "")
START_NS = gpstime.from_calendar(datetime(2012, 10, 31))


def commands(pattern: str) -> list[list[str]]:
    """Words of the commands of the README, files by their paths."""
    found = re.findall(f"^    gnss-hil ({pattern}.*)$", README, re.M)
    return [line.replace("examples/sky", str(SKY)).split() for line in found]


def craft(folder: Path, *words: str) -> dict:
    assert main([*words, "--bus", "inline", "--quiet", "--no-report", "--no-log", "--out", str(folder)]) == 0
    return json.loads((folder / "summary.json").read_text())["craft"]["soyuz"]


def made(folder: Path, seed: str | None = None) -> Path:
    """The files of the sky, written by the commands of the README; seed: another one than they have."""
    (run,), (export,) = commands("run soyuz --seed"), commands("export sky")
    place = dict(zip(("runs/sky", str(SKY)), (str(folder / "run"), str(folder / "sky")), strict=True))
    run, export = ([place.get(word, word) for word in words] for words in (run, export))
    if seed:
        run[run.index("--seed") + 1] = seed
    assert main([*run, "--quiet", "--no-report", "--no-log"]) == 0
    assert main(export) == 0
    return folder / "sky"


def test_messages_fly_as_the_nominal_sky(tmp_path):
    command = next(words for words in commands("run soyuz --nav") if "--sp3" not in words)
    short = "--duration", "120"
    nominal, of_file = (
        craft(tmp_path / "nominal", "run", "soyuz", *short),
        craft(tmp_path / "file", *command, *short),
    )
    assert of_file["fixes"] == nominal["fixes"] > 60
    assert of_file["satellites_tracked"] == nominal["satellites_tracked"]
    assert of_file["position_error_m"]["median"] == pytest.approx(
        nominal["position_error_m"]["median"], rel=0.2
    )


def test_the_commands_of_the_readme_write_the_files_that_ship(tmp_path):
    """To the digits that another processor's sine may differ in."""
    written = made(tmp_path)
    assert sum(path.stat().st_size for path in SKY.iterdir()) < 300_000
    ours, theirs = (rinex_nav.read(folder / "broadcast.nav").records for folder in (written, SKY))
    assert set(ours) == set(theirs) == {"G", "R"}
    for letter, records in ours.items():
        assert records.epoch == theirs[letter].epoch
        assert records.number.tolist() == theirs[letter].number.tolist()
        for name, column in records.fields.items():
            assert np.allclose(column, theirs[letter].fields[name], rtol=1e-7, atol=1e-18), (letter, name)
    mine, shipped = (sp3.read(folder / "orbits.sp3") for folder in (written, SKY))
    assert mine.name == shipped.name and mine.t_ns.tolist() == shipped.t_ns.tolist()
    assert np.abs(mine.pos_ecef_m - shipped.pos_ecef_m).max() < 2e-3
    assert np.abs(mine.clock_s - shipped.clock_s).max() < 2e-12


def true_orbits() -> tuple[np.ndarray, dict[int, tuple[np.ndarray, np.ndarray]]]:
    """Instants (t,) of the messages' time, and by satellite index its centre of mass (t, 3) [m] and its clock
    (t,) [s], as the package sp3 reads them."""
    product = peer("sp3.parse").Product.from_bytes((SKY / "orbits.sp3").read_bytes())
    begin, end = datetime(2012, 10, 31, tzinfo=UTC), datetime(2012, 10, 31, 1, 15, tzinfo=UTC)
    # Its times are UTC: leap seconds are taken off.
    leap = timedelta(seconds=gpstime.leap_seconds(START_NS))
    kept = {
        satellites.parse(one.id.decode()): [r for r in one.records if begin <= r.time + leap <= end]
        for one in product.satellites
    }
    t_ns = START_NS + 300 * 10**9 * np.arange(16)
    assert {len(records) for records in kept.values()} == {len(t_ns)}
    return t_ns, {
        index: (np.array([r.position for r in records]), np.array([r.clock for r in records]))
        for index, records in kept.items()
    }


def message_errors(system: str) -> tuple[np.ndarray, ...]:
    """Messages less orbits (t, n) [m]: radial, along and across the track, clock."""
    t_ns, truth = true_orbits()
    messages = from_files(
        system, [SKY / "broadcast.nav"], Time(start_gps="2012-10-31T00:00:00", duration_s=4500)
    )
    place_m, clock_m, broadcast = messages.sample(t_ns, np.array((-0.5, 0.0, 0.5)))
    assert broadcast.available.all() and len(messages.index) == 24
    centre_m, clock_s = (
        np.stack([truth[index][part] for index in messages.index.tolist()], axis=1) for part in (0, 1)
    )
    sun_m = sun_ecef_m(t_ns, gpstime.leap_seconds(START_NS))[:, None]
    offset_m = phase_centre.offsets_m(datetime(2012, 10, 31).date())[messages.index]
    off_m = place_m[:, 1] - phase_centre.antenna_m(centre_m, sun_m, offset_m)
    velocity_mps = place_m[:, 2] - place_m[:, 0]
    relativity_m = -2 * np.einsum("tnj,tnj->tn", place_m[:, 1], velocity_mps) / LIGHT_MPS
    late_m = clock_m[:, 1] + broadcast.group_delay_m - relativity_m - LIGHT_MPS * clock_s
    axes = orbital_axes(place_m[:, 1], velocity_mps)
    return *(np.einsum("tnj,tnj->tn", off_m, axis) for axis in axes), late_m


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("system", "of_radial", "of_others", "published_m"), [("gps", 0.98, 49, 0.7), ("glonass", 0.98, 45, 1.9)]
)
def test_messages_err_as_published_and_as_the_readme_says(system, of_radial, of_others, published_m):
    """Weights of the mean over the Earth: Montenbruck, Steigenberger and Hauschild (2015), table 4."""
    radial, along, across, clock = message_errors(system)
    ranges_m = np.sqrt(
        rms(of_radial * radial - clock) ** 2 + (rms(along) ** 2 + rms(across) ** 2) / of_others
    )
    assert ranges_m == pytest.approx(published_m, rel=0.15)
    (said,) = re.findall(rf"^\| {system.upper()} \(.*\) \| (.*) \|$", README, re.M)
    found = [rms(radial), rms(along), rms(across), rms(clock), float(ranges_m)]
    print(system, " | ".join(f"{value:.2f}" for value in found))
    assert found == pytest.approx([float(value) for value in said.split(" | ")], abs=0.01)


@pytest.mark.parametrize(("system", "changes"), [("gps", [11]), ("glonass", [1, 4, 7, 10, 13])])
def test_errors_are_smooth_within_a_message_and_new_at_the_next(system, changes):
    """Changes, as intervals of five minutes: GPS at one o'clock, GLONASS midway between quarters of an hour.
    Clock errors stand still within a message; orbits of one upload go on."""
    radial, along, across, clock = message_errors(system)
    grown_m = np.abs(np.diff(clock, axis=0))
    same = np.delete(grown_m, changes, axis=0)
    assert same.max() < 2e-3 < 0.01 < np.median(grown_m[changes])
    for part in (radial, along, across):
        within = np.abs(np.delete(np.diff(part, axis=0), changes, axis=0))
        assert within.max() < 0.4


@pytest.mark.slow(seconds=30)
def test_fixes_by_wrong_messages_are_as_uncertain_as_they_say(tmp_path):
    """Of the sky that ships, and of skies of other seeds: errors of a sky last through an hour, so that
    single skies scatter from 2 to 6."""
    command = next(words for words in commands("run soyuz --duration") if "--sp3" in words)
    nees = {}
    for seed in ("1", "2", "3", "4", "5", "6"):
        folder = made(tmp_path / seed, seed)
        moved = [word.replace(str(SKY), str(folder)) for word in command]
        found = craft(tmp_path / seed / "flown", *moved, "--seed", seed, "--interval", "10")["converged"]
        nees[seed] = found["nees"]["position"], found["nees"]["velocity"], found["position_error_m"]["median"]
    print(nees)
    assert 2 < np.mean([position for position, _, _ in nees.values()]) < 4
    assert 2.5 < np.mean([velocity for _, velocity, _ in nees.values()]) < 3.6
    assert 2 < nees["2"][0] < 4
    (said_m,) = re.findall(r"median error (\S+) m", README)
    assert nees["2"][2] == pytest.approx(float(said_m), rel=0.1)
