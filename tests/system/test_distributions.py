"""The emulator plays the world that it played before its rebuild: noise of signals and satellites have the
same distributions over seeds, though every draw is another."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.distributions import over_seeds

BEFORE = tomllib.loads((Path(__file__).parent / "distributions.toml").read_text())
SEEDS = range(101, 107)
OF_A_MEDIAN = 1.2533
"""Standard error of a median of normal numbers over that of their mean."""

SIGMAS, ROUNDED = 4.0, 0.005


@pytest.mark.parametrize(("name", "switches"), [("soyuz", []), ("all", ["--on", "all"])])
def test_figures_are_those_of_the_former_emulator_within_their_scatter(tmp_path, name, switches):
    folders = [tmp_path / str(seed) for seed in SEEDS]
    for seed, folder in zip(SEEDS, folders, strict=True):
        words = ["run", "soyuz", *switches, "--seed", str(seed), "--duration", str(BEFORE["duration_s"])]
        assert main([*words, "--bus", "inline", "--quiet", "--no-report", "--out", str(folder)]) == 0
    error = SIGMAS * OF_A_MEDIAN * np.sqrt(1 / len(SEEDS) + 1 / BEFORE["seeds"])
    off = {}
    found = over_seeds(folders)
    for figure, before in BEFORE[name].items():
        values = found[figure]
        allowed = error * before["scatter"] + ROUNDED * before["median"]
        if abs(np.median(values) - before["median"]) > allowed:
            off[figure] = float(np.median(values)), before["median"], allowed
    assert not off
