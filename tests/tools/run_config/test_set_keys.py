"""--set: any key of a scenario, typed and checked by its model."""

from __future__ import annotations

from copy import deepcopy

import pytest

from gnss_hil.dbc.common import model_tree
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.scenario import Scenario, ScenarioError
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config import set_keys
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.plan import make, resolve

pytestmark = pytest.mark.verifies(
    "tools/run_config/set_keys.py",
    what="--set",
    by="every key of the scenario's model can be set; what is set is what the plan has",
    status="validated",
)

DOCUMENT = scenarios.read(scenarios.shipped()["soyuz"])


def changed(*sets: tuple[str, str]) -> Scenario:
    return resolve("soyuz", Overrides(sets=sets)).scenario


@pytest.mark.parametrize(
    ("key", "text", "read"),
    [
        ("craft.0.orbit.altitude_km", "500", lambda s: s.craft[0].orbit.altitude_km == 500.0),
        ("seed", "7", lambda s: s.seed == 7),
        ("name", "12", lambda s: s.name == "12"),
        ("name", '"quoted"', lambda s: s.name == "quoted"),
        ("craft.0.orbit.forces", '["j2", "sun"]', lambda s: s.craft[0].orbit.forces == ("j2", "sun")),
        ("craft.0.factors.code_noise", "false", lambda s: not s.craft[0].factors.code_noise.enabled),
        ("craft.0.factors.cycle_slips", "{}", lambda s: s.craft[0].factors.cycle_slips.enabled),
        ("craft.0.flight.options.hysteresis_deg", "3",
         lambda s: s.craft[0].flight.options == {"hysteresis_deg": 3}),
        ('expect."soyuz.fixes".min', "3", lambda s: s.expect["soyuz.fixes"].min == 3),
        ("expect", '{"frames.lost" = {max = 0}}', lambda s: s.expect["frames.lost"].max == 0),
        ("time.start_gps", "2013-01-01T00:00:00", lambda s: s.time.start_gps.year == 2013),
        ("craft.0.attitude", '{mode = "slew", profile = [{t_s = 5}]}',
         lambda s: s.craft[0].attitude.profile[0].t_s == 5),
    ],
)  # fmt: skip
def test_what_is_set_is_what_is_played(key, text, read):
    assert read(changed((key, text)))


def test_rows_of_lists_and_tables_of_switches():
    document = deepcopy(DOCUMENT)
    document["craft"][0]["factors"] = {"code_noise": False}
    document["craft"][0]["orbit"]["forces"] = ["j2", "j3"]
    sets = (("craft.0.factors.code_noise.enabled", "true"), ("craft.0.orbit.forces.1", "sun"))
    set_keys.apply(document, sets)
    assert document["craft"][0]["factors"] == {"code_noise": {"enabled": True}}
    assert document["craft"][0]["orbit"]["forces"] == ["j2", "sun"]


@pytest.mark.parametrize(
    "path", [path for path, _ in model_tree.values(Scenario)], ids=lambda p: ".".join(map(str, p))
)
def test_every_key_of_the_model_is_found(path):
    key = ".".join(map(str, path))
    assert set_keys.parsed(key) == path
    assert set_keys._kind(path, key) is not None


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ([("craft.0.orbit.altitud_km", "5")], "craft.0.orbit has no key 'altitud_km'; "
         "did you mean 'craft.0.orbit.altitude_km'?"),
        ([("duration", "5")], "did you mean 'time.duration_s'?"),
        ([("craft.orbit.altitude_km", "5")], "craft is a list: a number of a row comes next, as in craft.0"),
        ([("craft.1.name", "a")], "craft has rows 0 to 0"),
        ([("craft.0.orbit.forces.0", "j2")], "has no rows in the scenario; set it as a list"),
        ([("seed.x", "5")], "seed is no table, 'x' cannot be in it"),
        ([("a b", "5")], "not a path of keys"),
        ([("seed.", "5")], "not a path of keys"),
        ([("seed", "1"), ("seed", "2")], "given 2 times"),
        ([("craft.0.orbit.altitude_km", "high")], "km: input should be a valid number, found 'high'"),
        ([("craft.0.orbit.altitude_km", "nan")], "--set craft.0.orbit.altitude_km: input should be a finite"),
        ([("seed", "1.5")], "--set seed: input should be a valid integer, found 1.5"),
        ([("seed", "1\nname = 3")], "--set seed: input should be a valid integer"),
        ([("craft.0.orbit", "3")], "--set craft.0.orbit: must be a table"),
        ([("craft.0.flight.options.hysteresis", "3")], "did you mean 'hysteresis_deg'?"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_that_names_what_was_set(sets, words):
    with pytest.raises((Mistake, ScenarioError)) as caught:
        make("soyuz", Overrides(sets=tuple(sets)))
    (line,) = str(caught.value).splitlines()
    assert words in line


def test_an_option_and_the_same_key_contradict_each_other():
    with pytest.raises(Mistake, match="--set seed with --seed: one of the two"):
        resolve("soyuz", Overrides(seed=3, sets=(("seed", "4"),)))
    with pytest.raises(Mistake, match="with --duration: one of the two"):
        resolve("soyuz", Overrides(duration_s=3.0, sets=(('"time".duration_s', "4"),)))


def test_files_are_seen_from_where_the_command_is_typed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.nav").touch()
    assert changed(("sky.gps", '["x.nav"]')).sky.gps == [str(tmp_path / "x.nav")]
