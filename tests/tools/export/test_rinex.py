"""RINEX files of a run: read back, judged by Hatanaka's tools, and their physics."""

from __future__ import annotations

import re
from dataclasses import replace

import hatanaka
import numpy as np
import polars
import pytest

from gnss_hil.emulator.constellation.precise_sky import PreciseConstellation
from gnss_hil.emulator.files import rinex_nav, rinex_obs
from gnss_hil.tools.export import navigation, rinex
from gnss_hil.tools.export.codes import codes_of
from gnss_hil.tools.export.reduce import one_clock, reduced
from gnss_hil.tools.export.rinex_obs import loss_of_lock
from gnss_hil.tools.export.run_data import Rows


@pytest.fixture(scope="module")
def files(decoded) -> dict[str, str]:
    made, remarks = rinex.files_of(*[decoded[0], [decoded[1]]], rinex.Choices())
    assert remarks == []
    return {file.name: "".join(file.text) for file in made}


def test_one_file_an_antenna_one_of_the_craft_and_two_of_the_sky(files):
    antennas = {f"soyuz_{name}.obs" for name in ("fore", "starboard", "aft", "port")}
    assert set(files) == antennas | {"soyuz.obs", "broadcast.nav", "satellites.sp3"}


@pytest.mark.parametrize("antenna", ["fore", "port"])
def test_an_antennas_file_says_what_the_bus_said(files, decoded, antenna):
    """Read back by the bench's reader, which real files judge; signs and steps by RINEX 3.04, table A3."""
    craft = decoded[1]
    number = craft.vehicle.names.index(antenna)
    rows = craft.rows[craft.rows.receiver == number]
    read = rinex_obs.parse(files[f"soyuz_{antenna}.obs"], "written")
    assert read.sat.tolist() == rows.sat.tolist()
    wave_m = np.where(rows.sat < 64, 0.190293672798, 299_792_458 / (1602e6 + 562.5e3 * rows.frequency))
    for code, wanted, step in (
        ("C1C", rows.pseudorange_m, 1e-3),
        ("L1C", rows.phase_cyc, 1e-3),
        ("D1C", -rows.range_rate_mps / wave_m, 1e-3),
        ("S1C", rows.cn0_dbhz, 1e-3),
    ):
        assert np.abs(read.obs[code] - wanted).max() <= 0.51 * step, code


@pytest.mark.verifies(what="Tables of a run: almanac as told, clocks as shown")
def test_epochs_are_tagged_with_the_receivers_clock(files, run, decoded):
    """The clock's offset is known to truth; the tag has it to its counter's 100 ns."""
    read = rinex_obs.parse(files["soyuz_fore.obs"], "written")
    truth = polars.read_parquet(run / "truth.parquet")
    clock_s = dict(zip((truth["t_gps_s"] * 1e3).round().cast(int), truth["clock_0_s"], strict=True))
    assert len(read.t_ns) > 40
    for t in read.t_ns.tolist():
        mark_ms = round(t / 1e9) * 1000
        error_ns = t - mark_ms * 1_000_000 - clock_s[mark_ms] * 1e9
        assert -100 <= error_ns <= 0


def test_hatanakas_compressor_takes_every_observation_file(files):
    """RNX2CRX refuses what is not RINEX; what it makes comes back as it was, but for zeros before points."""

    def pointed(text: str) -> str:
        return re.sub(r"(?<= )(-?)0\.(?=\d{3}[ \d])", r" \1.", text)

    for name, text in files.items():
        if name.endswith(".obs"):
            back = hatanaka.crx2rnx(hatanaka.rnx2crx(text))
            assert pointed(back).split("END OF HEADER")[1] == pointed(text).split("END OF HEADER")[1], name


def test_every_line_keeps_to_its_columns(files):
    """Headers of RINEX have their labels from column 61; no line of them, and none of SP3, is beyond 80."""
    for name, text in files.items():
        assert text.isascii()
        lines = text.splitlines()
        if name.endswith((".obs", ".nav")):
            lines = lines[: next(k for k, line in enumerate(lines) if "END OF HEADER" in line) + 1]
            assert all(re.match(r"[A-Z]", line[60:]) for line in lines), name
        assert len(lines) > 5 and max(map(len, lines)) <= 80, name


def test_range_and_phase_of_the_centre_of_mass_belong_together(decoded):
    """Doppler is the phase's rate: over an epoch the phase grows by the mean of two range rates, and
    nothing but the third derivative, 1 mm, is between them."""
    found = reduced(decoded[1], shapiro=True).rows
    wave_m = codes_of(found).wave_m
    order = np.lexsort((found.epoch, found.sat))
    r, wave = found[order], wave_m[order]
    on = (np.diff(r.sat) == 0) & (np.diff(r.epoch) == 1) & (np.diff(r.receiver) == 0)
    on &= (np.diff(r.channel) == 0) & (np.diff(r.slips) == 0)
    grown_m = np.diff(r.phase_cyc) * wave[1:]
    mean_mps = (r.range_rate_mps[1:] + r.range_rate_mps[:-1]) / 2
    assert on.sum() > 500
    assert np.abs(grown_m - np.diff(r.pseudorange_m))[on].max() < 1e-3
    assert np.abs(grown_m - mean_mps)[on].max() < 5e-3


def test_a_satellite_measured_twice_is_there_once_by_the_measurement_in_the_fix(decoded):
    craft = decoded[1]
    first = craft.rows.epoch == craft.rows.epoch[0]
    twice = craft.rows[first]
    stronger = replace(
        twice, cn0_dbhz=twice.cn0_dbhz + 5, used=np.zeros(len(twice), bool), receiver=3 - twice.receiver
    )
    joined = Rows(*(np.concatenate((getattr(twice, n), getattr(stronger, n))) for n in Rows.__slots__))
    found = reduced(replace(craft, rows=joined), shapiro=True)
    assert found.repeated == len(joined) - len(np.unique(twice.sat))
    assert found.rows.used.all()


def rows_of(sat, epoch, receiver, channel, slips) -> Rows:
    n = len(sat)
    columns = {name: np.zeros(n) for name in Rows.__slots__}
    given = {"sat": sat, "epoch": epoch, "receiver": receiver, "channel": channel, "slips": slips}
    columns |= {name: np.array(values) for name, values in given.items()}
    columns |= {name: np.zeros(n, int) for name in ("signal", "half_cycle")}
    return Rows(**columns)


def test_loss_of_lock_is_told_where_a_phase_does_not_go_on():
    """G01: begins, goes on, slips, is away for an epoch, moves to another channel; R03 goes on throughout."""
    g, r = 1, 67
    rows = rows_of(
        sat=[g, g, g, g, g, r, r], epoch=[0, 1, 2, 4, 5, 0, 1], receiver=[0] * 7,
        channel=[2, 2, 2, 2, 3, 1, 1], slips=[0, 0, 1, 1, 1, 7, 7],
    )  # fmt: skip
    assert loss_of_lock(rows).tolist() == [0, 0, 1, 1, 1, 0, 0]


def test_the_navigation_file_reads_back_with_what_the_satellites_broadcast(files, decoded):
    read = rinex_nav.parse(files["broadcast.nav"], "written")
    wanted = navigation.messages(
        navigation.constellations(decoded[0]), navigation.span_ns([decoded[1]]), wgs84=True
    )
    for letter, records in wanted.items():
        got = read.records[letter]
        order = np.lexsort((records.number, [e.timestamp() for e in records.epoch]))
        assert got.number.tolist() == records.number[order].tolist()
        for name, column in records.fields.items():
            assert np.allclose(got.fields[name], column[order], rtol=1e-12, atol=0), (letter, name)
    assert read.glonass_to_utc_s == 0


def test_systems_of_precise_orbits_are_left_out_of_the_navigation_file_by_name(decoded, monkeypatch):
    """The others are in it; where no system is left there is no file, and one remark says why."""
    scenario, craft = decoded
    sky, span_ns = navigation.constellations(scenario), navigation.span_ns([craft])
    none = np.zeros(0, np.int64)
    gps_precise = sky | {"G": PreciseConstellation(none, None, none)}
    found = navigation.messages(gps_precise, span_ns, wgs84=True)
    assert set(found) == {"R"}
    why = "gps (precise orbits have no messages)"
    assert navigation.without_messages(gps_precise, found) == why
    assert navigation.without_messages(sky, navigation.messages(sky, span_ns, wgs84=True)) == ""
    for left, remark in ((found, "broadcast.nav is without"), ({}, "no broadcast.nav:")):
        monkeypatch.setattr(navigation, "messages", lambda *_, left=left, **__: left)
        monkeypatch.setattr(navigation, "without_messages", lambda *_: why)
        made, remarks = rinex.files_of(scenario, [craft], rinex.Choices())
        assert remarks == [f"{remark} {why}"]
        assert ("broadcast.nav" in {file.name for file in made}) == bool(left)
        assert "satellites.sp3" in {file.name for file in made}


def test_satellites_of_another_sky_get_no_navigation_file(decoded):
    scenario, craft = decoded
    off = replace(craft, rows=replace(craft.rows, pos_sv_m=craft.rows.pos_sv_m + np.array((0, 0, 150.0))))
    known = navigation.messages(navigation.constellations(scenario), navigation.span_ns([craft]), wgs84=True)
    assert navigation.disagreement_m(known, craft) < 1e-3
    assert navigation.disagreement_m(known, off) == pytest.approx(150, abs=0.1)
    made, remarks = rinex.files_of(scenario, [off], rinex.Choices())
    assert not {"broadcast.nav", "satellites.sp3"} & {file.name for file in made}
    assert len(remarks) == 1 and "150 m" in remarks[0]
    near = replace(craft, rows=replace(craft.rows, pos_sv_m=craft.rows.pos_sv_m + np.array((0, 0, 2.0))))
    made, remarks = rinex.files_of(scenario, [near], rinex.Choices())
    assert "broadcast.nav" in {file.name for file in made} and "2 m" in remarks[0]


def test_several_clocks_have_no_file_of_the_centre_of_mass(decoded):
    craft = decoded[1]
    assert one_clock(craft)
    late = craft.tag_offset_ns + np.array((0, 0, 100, 0))
    for other in (replace(craft, domain=craft.domain + np.arange(4)), replace(craft, tag_offset_ns=late)):
        assert not one_clock(other)
        made, remarks = rinex.files_of(decoded[0], [other], rinex.Choices(navigation=False))
        assert len(made) == 4 and "several clocks" in remarks[0]
