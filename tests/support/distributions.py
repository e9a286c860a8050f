"""What a run's noise and fixes are like, from its tables: figures whose distribution over seeds shows whether
two versions play the same world.

`python -m tests.support.distributions FOLDER ...` prints medians and scatters of run folders as TOML.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import polars as pl

LIGHT_MPS, SPIN_RPS = 299_792_458.0, 7.2921151467e-5
JUMP_M = 0.05


def figures(run: Path) -> dict[str, float]:
    """Of a run folder.

    range_m, rate_mps, phase_m   rms of the channels' residuals against the truth, what all channels of a
                                 receiver and system share taken out; of phases their steps from epoch to
                                 epoch over the square root of two, slips left out
    cn0_dbhz, tracked            mean strength, mean number of channels in an epoch
    satellites, pdop, error_m    of the fixes: mean of distinct satellites, medians of dilution and error
    """
    truth, fixes = pl.read_parquet(run / "truth.parquet"), pl.read_parquet(run / "fixes.parquet")
    channels = pl.read_parquet(run / "channels.parquet").join(truth, on="t_gps_s", suffix="_craft")
    channels = channels.sort("receiver", "channel", "t_gps_s")
    return _of_channels(channels, run) | {"tracked": len(channels) / len(fixes)} | _of_fixes(fixes, truth)


def _columns(table: pl.DataFrame, *names: str) -> np.ndarray:
    return table.select(names).to_numpy().astype(float)


def _of_channels(table: pl.DataFrame, run: Path) -> dict[str, float]:
    along_m, rate_mps = _modelled(table, run)
    number = {key: table[key].to_numpy() for key in ("receiver", "channel", "slips")}
    t_s = table["t_gps_s"].to_numpy()
    system = np.array([name[0] == "G" for name in table["satellite"]])
    shared = [t_s, number["receiver"], system]
    wave_m = LIGHT_MPS / np.where(
        system, 1575.42e6, 1602e6 + 562.5e3 * table["sv_frequency"].to_numpy().astype(float)
    )
    phase_m = table["phase_cyc"].to_numpy() * wave_m - along_m
    same = (np.diff(t_s) == 1) & (np.diff(number["slips"]) == 0)
    same &= (np.diff(number["receiver"]) == 0) & (np.diff(number["channel"]) == 0)
    same &= table["satellite"].to_numpy()[1:] == table["satellite"].to_numpy()[:-1]
    step_m = _rms(np.diff(phase_m)[same], [key[1:][same] for key in shared], JUMP_M)
    return {
        "range_m": _rms(table["pseudorange_m"].to_numpy() - along_m, shared),
        "rate_mps": _rms(table["range_rate_mps"].to_numpy() - rate_mps, shared),
        "phase_m": step_m / np.sqrt(2),
        "cn0_dbhz": float(table["cn0_dbhz"].mean()),
    }


def _modelled(table: pl.DataFrame, run: Path) -> tuple[np.ndarray, np.ndarray]:
    """Pseudoranges [m] and range rates [m/s] (p,) by truth and what satellites report, without receiver
    clock."""
    vehicle = tomllib.loads((run / "vehicle.toml").read_text())
    arm = np.array([antenna["lever_arm_body_m"] for antenna in vehicle["antenna"]])
    arm = arm[table["receiver"].to_numpy().astype(int) - 1]
    body = _rotations(_columns(table, *(f"q{i}_body_from_ecef" for i in range(4)))).swapaxes(1, 2)
    arm_ecef = np.einsum("pij,pj->pi", body, arm)
    rate = np.einsum("pij,pj->pi", body, _columns(table, "wx_body_rps", "wy_body_rps", "wz_body_rps"))
    place = _columns(table, "x_ecef_m", "y_ecef_m", "z_ecef_m")
    velocity = _columns(table, "vx_ecef_mps", "vy_ecef_mps", "vz_ecef_mps") + _spun(place)
    velocity = velocity + np.cross(rate, arm_ecef)
    place = place + arm_ecef
    sv = _columns(table, "sv_x_ecef_m", "sv_y_ecef_m", "sv_z_ecef_m")
    sv_velocity = _columns(table, "sv_vx_ecef_mps", "sv_vy_ecef_mps", "sv_vz_ecef_mps") + _spun(sv)
    angle = SPIN_RPS * np.linalg.norm(sv - place, axis=1) / LIGHT_MPS
    for _ in range(3):
        turned, turned_mps = _turned(sv, angle), _turned(sv_velocity, angle)
        length = np.linalg.norm(turned - place, axis=1)
        angle = SPIN_RPS * length / LIGHT_MPS
    unit = (turned - place) / length[:, None]
    # The satellite's motion counts by the time it has, which is shorter while the range grows.
    leaving, following = (np.einsum("pj,pj->p", unit, v) for v in (turned_mps, velocity))
    away = (leaving - following) / (1 + leaving / LIGHT_MPS)
    clock = _columns(table, "sv_clock_m", "sv_clock_drift_mps")
    return length - clock[:, 0], away - clock[:, 1]


def _rotations(q: np.ndarray) -> np.ndarray:
    """(p, 3, 3) matrices of passive quaternions (p, 4)."""
    w, v = q[:, 0], q[:, 1:]
    skew = np.zeros((len(q), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    skew -= skew.swapaxes(1, 2)
    eye = np.eye(3)
    return ((2 * w**2 - 1)[:, None, None] * eye + 2 * v[:, :, None] * v[:, None, :]
            - 2 * w[:, None, None] * skew)  # fmt: skip


def _spun(place: np.ndarray) -> np.ndarray:
    return SPIN_RPS * np.stack((-place[:, 1], place[:, 0], 0 * place[:, 0]), axis=1)


def _turned(vector: np.ndarray, angle: np.ndarray) -> np.ndarray:
    cos, sin, (x, y, z) = np.cos(angle), np.sin(angle), vector.T
    return np.stack((cos * x + sin * y, cos * y - sin * x, z), axis=1)


def _rms(residual: np.ndarray, shared: list[np.ndarray], within: float = np.inf) -> float:
    """Of residuals (p,), the mean of each group of equal keys taken out; groups of one say nothing."""
    _, group = np.unique(np.stack(shared), axis=1, return_inverse=True)
    group = group.reshape(-1)
    count = np.bincount(group)
    left = residual - (np.bincount(group, residual) / count)[group]
    kept = (count[group] > 1) & (np.abs(left) < within)
    return float(np.sqrt(np.sum(left[kept] ** 2) / np.sum(1 - 1 / count[group][kept])))


def _of_fixes(fixes: pl.DataFrame, truth: pl.DataFrame) -> dict[str, float]:
    both = fixes.filter(pl.col("valid")).join(truth, on="t_gps_s", suffix="_true")
    off = [both[f"{axis}_ecef_m"] - both[f"{axis}_ecef_m_true"] for axis in "xyz"]
    return {
        "satellites": float(both["satellites"].mean()),
        "pdop": float(both["pdop"].median()),
        "error_m": float(np.median(np.sqrt(sum(part.to_numpy() ** 2 for part in off)))),
    }


def over_seeds(runs: Iterable[Path]) -> dict[str, np.ndarray]:
    """Each figure of all runs, (seeds,)."""
    every = [figures(run) for run in runs]
    return {name: np.array([one[name] for one in every]) for name in every[0]}


def main(folders: list[str]) -> None:
    for name, values in over_seeds(map(Path, folders)).items():
        median = np.median(values)
        scatter = 1.4826 * np.median(np.abs(values - median))
        print(f"{name} = {{ median = {median:.6g}, scatter = {scatter:.3g} }}")


if __name__ == "__main__":
    main(sys.argv[1:])
