"""Out and in again: observations that the bench exported, played as those of a receiver.

One antenna under the satellites of 2023-03-23, which fly ESA's final orbits and report what they broadcast on
that day; one frequency, no noise, no ionosphere, and none is taken off. The same day's orbits and messages
play the file. Both ways go through one sky: what that makes of group delays is judged from outside in
`test_precise_orbits` and `test_group_delays`.
"""

from __future__ import annotations

import json

import pytest

from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main
from tests.support.outside import data_file

pytestmark = pytest.mark.realdata


@pytest.fixture(scope="module")
def sky():
    return {
        "--nav": str(data_file("navigation/brdc0820.23n.gz")),
        "--sp3": str(data_file("precise_orbits/ESA0OPSFIN_20230820000_01D_05M_ORB.SP3.gz")),
    }


def run(out, *words):
    """Errors of the fixes of a run."""
    plain = ("--bus", "inline", "--quiet", "--no-report", "--interval", "10", "--out", str(out))
    assert main(["run", *map(str, words), *plain]) == 0
    (craft,) = json.loads((out / "summary.json").read_text())["craft"].values()
    assert craft["fixes"] > 100
    return craft["position_error_m"]


@pytest.fixture(scope="module")
def exported(tmp_path_factory, sky):
    """Folder of the exported files, and the errors of the run's own fixes."""
    folder = tmp_path_factory.mktemp("round")
    text = shipped()["soyuz"].read_text().replace("soyuz-ms.toml", "observed.toml")
    text = text.replace("2012-10-31T00:15:00", "2023-03-23T02:00:00").replace(
        'glonass = "nominal"', 'glonass = "none"'
    )
    (folder / "one.toml").write_text(text)
    words = [word for pair in sky.items() for word in pair]
    errors = run(folder / "run", folder / "one.toml", *words, "--off", "all", "--duration", "20m")
    assert main(["export", "rinex", str(folder / "run"), "--out", str(folder)]) == 0
    assert main(["export", "oem", str(folder / "run"), "--truth", "--out", str(folder)]) == 0
    return folder, errors


def played(exported, tmp_path, sky, *options):
    folder, _ = exported
    words = [word for option in options for word in (option, sky[option])]
    observations = ("--obs", folder / "soyuz_antenna.obs", "--reference", folder / "soyuz.oem")
    return run(tmp_path / "run", "replay", *observations, *words, "--option", "ionosphere=off")


@pytest.mark.verifies(
    "emulator/constellation/sky.py",
    "emulator/receivers/recorded/receiver.py",
    what="Out and in again: export, replay, orbits with the messages' group delays",
    by=(
        "our writers against our readers, each judged above: 0.5 mm under ESA's final orbits and one day's "
        "messages; without the messages' group delays 1.54 m"
    ),
    status="modelled",
)
def test_orbits_and_messages_together_bring_the_truth_back(exported, tmp_path, sky):
    """The orbits' clocks are those of two frequencies; for one the messages have the group delays."""
    error = played(exported, tmp_path, sky, "--nav", "--sp3")
    print(f"replay of an export, orbits and group delays: {error}")
    assert error["max"] < 5e-3


def test_orbits_alone_lack_the_group_delays(exported, tmp_path, sky):
    assert 0.5 < played(exported, tmp_path, sky, "--sp3")["median"] < 5


def test_messages_alone_bring_the_errors_of_the_messages_back(exported, tmp_path, sky):
    _, own = exported
    again = played(exported, tmp_path, sky, "--nav")
    assert own["median"] > 0.3
    assert abs(again["median"] - own["median"]) < 0.02
