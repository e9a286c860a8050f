"""The exported files judged by RTKLIB: it reads them without a complaint and finds the same positions.

What RTKLIB is told, and why: docs/export.md. The figures there are printed here (`pytest -s`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.tools.command_line.main import main
from tests.support.rtklib import OWN_WEIGHTS, solve

pytestmark = [
    pytest.mark.verifies(
        "tools/export/rinex_obs.py",
        "tools/export/rinex.py",
        "tools/export/rinex_systems.py",
        "tools/export/rinex_text.py",
        "tools/export/codes.py",
        "tools/export/run_data.py",
        "tools/export/reduce.py",
        "tools/export/navigation.py",
        "tools/export/satellite_orbits.py",
        what="Exported RINEX files, reduction to the centre of mass",
        by=(
            "RTKLIB reads them without a complaint: 2.6 mm rms without errors, with equal weights the errors "
            "of our fixes to 0.01 %; Hatanaka's RNX2CRX takes them"
        ),
        status="validated",
    ),
    pytest.mark.verifies(what="One epoch of an emulated craft, from scenario to frames"),
    pytest.mark.verifies(
        "emulator/constellation/messages.py",
        "emulator/constellation/nominal_messages.py",
        what="Navigation records of a sky",
        by="RTKLIB computes positions from the exported records and ranges: 3 mm",
        status="validated",
    ),
]

ALL_ALIKE = (
    "range_sigma_m=1", "exclude_satellites=0", "exclude_receivers=0", "inconsistent=fix",
)  # fmt: skip
"""Options with which our flight software weighs all ranges alike and leaves none out."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A run and its export; truth and fixes by GPS time [ns]."""

    folder: Path
    truth: dict[int, np.ndarray]
    fixes: dict[int, np.ndarray]
    attitude: dict[int, np.ndarray]

    @property
    def files(self) -> Path:
        return self.folder / "export"


def by_time(table: polars.DataFrame, names: list[str]) -> dict[int, np.ndarray]:
    t_ns = np.rint(table["t_gps_s"].to_numpy() * 1e3).astype(np.int64) * 1_000_000
    return dict(zip(t_ns.tolist(), table.select(names).to_numpy(), strict=True))


def played(folder: Path, *more: str, scenario: str = "soyuz") -> Run:
    assert main(["run", scenario, "--bus", "inline", "--out", str(folder), "--quiet", *more]) == 0
    assert main(["export", "rinex", str(folder)]) == 0
    truth, fixes = (polars.read_parquet(folder / f"{name}.parquet") for name in ("truth", "fixes"))
    axes = [f"{axis}_ecef_m" for axis in "xyz"]
    return Run(
        folder,
        by_time(truth, axes),
        by_time(fixes.filter(polars.col("valid")), axes),
        by_time(truth, [f"q{i}_body_from_ecef" for i in range(4)]),
    )


@pytest.fixture(scope="module")
def quiet(tmp_path_factory) -> Run:
    return played(tmp_path_factory.mktemp("rtklib") / "quiet", "--off", "all")


@pytest.fixture(scope="module")
def noisy(tmp_path_factory) -> Run:
    return played(tmp_path_factory.mktemp("rtklib") / "noisy")


@pytest.fixture(scope="module")
def alike(tmp_path_factory) -> Run:
    options = [word for option in ALL_ALIKE for word in ("--option", option)]
    return played(tmp_path_factory.mktemp("rtklib") / "alike", *options)


def errors(solutions, places: dict[int, np.ndarray]) -> np.ndarray:
    """(s,) 3-D distances [m]."""
    wanted = np.array([places[t] for t in solutions.t_ns.tolist()])
    return np.linalg.norm(solutions.position_m - wanted, axis=1)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_without_errors_the_centre_of_mass_comes_out_within_5_mm(quiet):
    found = solve(quiet.files, "soyuz.obs")
    assert found.complaints == []
    assert found.t_ns.tolist() == sorted(quiet.fixes), "every epoch with a fix, at the fix's time"
    truth, fix = errors(found, quiet.truth), errors(found, quiet.fixes)
    print(f"\nRTKLIB - truth {rms(truth) * 1e3:.2f} mm, - fix {rms(fix) * 1e3:.2f} mm rms")
    assert rms(truth) < 5e-3
    assert rms(fix) < 5e-3


def test_the_shapiro_delay_is_what_rtklib_does_not_know(quiet):
    out = quiet.folder / "shapiro"
    assert main(["export", "rinex", str(quiet.folder), "--shapiro", "--out", str(out)]) == 0
    found = solve(out, "soyuz.obs")
    error_m = errors(found, quiet.truth)
    print(f"\nwith the Shapiro delay in: {rms(error_m) * 1e3:.2f} mm rms")
    assert 5e-3 < rms(error_m) < 10e-3  # contract: 7 mm of position if left out


def test_the_messages_of_a_nominal_sky_serve_within_a_centimetre_per_satellite(quiet):
    found = solve(quiet.files, "soyuz.obs", **{"pos1-sateph": "brdc"})
    assert found.complaints == []
    error_m = errors(found, quiet.truth)
    tracking = found.satellites > 20
    whole, many = rms(error_m) * 1e3, rms(error_m[tracking]) * 1e3
    print(f"\nby messages: {whole:.1f} mm, with more than 20 satellites {many:.1f} mm")
    assert rms(error_m[tracking]) < 5e-3
    assert rms(error_m) < 50e-3  # six satellites, PDOP 28, in the first half minute


def test_each_antenna_is_where_its_lever_arm_says(quiet):
    """Five satellites of two systems are too few for RTKLIB; its DOP counts those above the horizontal."""
    craft = vehicle.load(quiet.folder / "vehicle.toml")
    for antenna, lever in zip(craft.names, craft.lever_arm_body_m, strict=True):
        found = solve(quiet.files, f"soyuz_{antenna}.obs")
        places = {t: quiet.truth[t] + turned_to_ecef(quiet.attitude[t], lever) for t in quiet.truth}
        error_m = errors(found, places)
        others = [c for c in found.complaints if "lack of valid sats" not in c and "gdop error" not in c]
        print(f"\n{antenna}: {len(error_m)} epochs, {rms(error_m) * 1e3:.1f} mm rms (Shapiro delay in)")
        assert others == []
        assert rms(error_m) < 20e-3


def turned_to_ecef(q: np.ndarray, vector_body: np.ndarray) -> np.ndarray:
    """Hamilton's product q v q*: with a passive body-from-ECEF quaternion, from body to ECEF."""
    w, xyz = q[0], q[1:]
    twice = 2 * np.cross(xyz, vector_body)
    return vector_body + w * twice + np.cross(xyz, twice)


def test_a_tag_0_3_ms_off_costs_decimetres(quiet, tmp_path):
    """What the receiver's clock is off here; satellites move by a metre in that time, most of it across."""
    for name in ("broadcast.nav", "satellites.sp3"):
        (tmp_path / name).write_text((quiet.files / name).read_text())
    text = (quiet.files / "soyuz.obs").read_text()
    late, count = re.subn(
        r"(?m)^(> .{16}) ([ \d]\d\.\d{7})", lambda m: f"{m[1]} {float(m[2]) + 3e-4:10.7f}", text
    )
    assert count == len(quiet.fixes)
    (tmp_path / "soyuz.obs").write_text(late)
    found = solve(tmp_path, "soyuz.obs")
    wanted = np.array([quiet.truth[round(t / 1e9) * 10**9] for t in found.t_ns.tolist()])
    assert np.median(np.linalg.norm(found.position_m - wanted, axis=1)) > 0.1


def test_weighed_alike_the_same_ranges_give_the_same_errors(alike):
    found = solve(alike.files, "soyuz.obs")
    assert found.complaints == []
    assert found.t_ns.tolist() == sorted(alike.fixes)
    theirs, apart = errors(found, alike.truth), errors(found, alike.fixes)
    ours = np.array([np.linalg.norm(alike.fixes[t] - alike.truth[t]) for t in found.t_ns.tolist()])
    print(f"\nalike: RTKLIB {rms(theirs):.3f} m, ours {rms(ours):.3f} m, ratio {rms(theirs) / rms(ours):.4f}")
    assert 0.95 < rms(theirs) / rms(ours) < 1.05
    once = measured_once(alike)
    single = np.array([t in once for t in found.t_ns.tolist()])
    assert single.sum() > 500
    ratio = rms(theirs[single]) / rms(ours[single])
    print(f"{single.sum()} epochs without a satellite measured twice: ratio {ratio:.5f}, "
          f"{rms(apart[single]) * 1e3:.2f} mm apart")  # fmt: skip
    assert abs(ratio - 1) < 1e-3
    assert rms(apart[single]) < 5e-3


def measured_once(run: Run) -> set[int]:
    """Epochs [ns] in which every satellite is on one channel."""
    table = polars.read_parquet(run.folder / "channels.parquet", columns=["t_gps_s", "satellite"])
    counts = table.group_by("t_gps_s").agg(polars.len().alias("all"), polars.col("satellite").n_unique())
    times = counts.filter(polars.col("all") == polars.col("satellite"))["t_gps_s"].to_list()
    return {round(t * 1e3) * 1_000_000 for t in times}


def test_with_each_ones_own_weights_the_ratio_is_told(noisy):
    found = solve(noisy.files, "soyuz.obs", **OWN_WEIGHTS)
    common = [t in noisy.fixes for t in found.t_ns.tolist()]
    theirs = errors(found, noisy.truth)[common]
    ours = np.array([np.linalg.norm(noisy.fixes[t] - noisy.truth[t]) for t in found.t_ns[common].tolist()])
    dropped = len(noisy.fixes) - sum(common)
    ratio = rms(theirs) / rms(ours)
    print(f"\nown weights: RTKLIB {rms(theirs):.3f} m, ours {rms(ours):.3f} m, ratio {ratio:.3f}; "
          f"dropped by RTKLIB's tests: {dropped} of {len(noisy.fixes)} epochs")  # fmt: skip
    assert dropped == 0
    assert 0.8 < ratio < 1.5


def test_rtklibs_elevation_mask_costs_it_half_the_satellites(noisy):
    """From orbit satellites are seen down to 19 deg below the horizontal."""
    every = solve(noisy.files, "soyuz.obs", **OWN_WEIGHTS)
    masked = solve(noisy.files, "soyuz.obs", **{**OWN_WEIGHTS, "pos1-elmask": "15"})
    print(f"\nmask 15 deg: {masked.satellites.mean():.1f} of {every.satellites.mean():.1f} satellites")
    assert masked.satellites.mean() < 0.6 * every.satellites.mean()


@pytest.mark.verifies(
    "emulator/signal/group_delays.py",
    what="Two carriers of an emulated run, without ionosphere",
    by="RTKLIB's combination of C1C and C2X of GPS, by the exported files: 3 mm off, by L1 metres",
    status="validated",
)
def test_rtklib_takes_the_ionosphere_from_two_carriers(tmp_path):
    """GPS alone: RTKLIB knows no Delta tau, which clocks of GLONASS need on L2."""
    off = [word for name in ("code_noise", "carrier_noise", "doppler_noise") for word in ("--off", name)]
    run = played(tmp_path / "two", "--duration", "200", *off, scenario="soyuz-l1l2")
    gps = {"pos1-navsys": "1"}
    both = solve(run.files, "soyuz.obs", **gps, **{"pos1-frequency": "l1+l2", "pos1-ionoopt": "dual-freq"})
    error_m = errors(both, run.truth)
    print(
        f"\nRTKLIB by two carriers: {np.median(error_m) * 1e3:.2f} mm median, {error_m.max() * 1e3:.2f} most"
    )
    assert len(error_m) > 100 and np.median(error_m) < 3e-3 and error_m.max() < 20e-3
    alone_m = errors(solve(run.files, "soyuz.obs", **gps, **{"pos1-ionoopt": "off"}), run.truth)
    assert np.median(alone_m) > 3
