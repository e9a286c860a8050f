"""Fault files: every mistake in one go; all that ship can be armed; the schema is of the same model."""

from __future__ import annotations

import pytest

from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.faults import engine, files
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.kinds.row import LINKS
from gnss_hil.emulator.faults.models import FaultError
from tests.support.emulated import document
from tests.support.faulted import CODEC, NS, VEHICLE

pytestmark = pytest.mark.verifies(what="Faults: files and one-liners")

BAD = """
[[fault]]
kind = "los"
on = "rx2"
[[fault]]
kind = "delay"
epoch = 3
on = "rx2"
[[fault]]
on = "rx2"
[[fault]]
kind = "range-step"
step_m = "30"
on = "G12 RANGEX"
at = "@10..5"
[[fault]]
kind = "masquerade"
on = "rx1"
change = ["RANGE.pseudorang_m += 3", "SV_Z.health = UNHELTHY"]
protection = "recompte"
expect = {within_epochs = 3}
"""
LINES = (
    "fault.0: no kind 'los'; did you mean 'loss'?",
    "fault.1.epoch: unknown key; did you mean 'epochs'?",
    "fault.2: which kind? the key is missing",
    "fault.3.on: no place 'RANGEX'; did you mean 'RANGE'?",
    "fault.3.at: stop 5.0 is not behind start 10.0",
    "fault.3.step_m: input should be a valid number, found '30'",
    "fault.4.expect: within_epochs goes with detected_by",
    "fault.4.protection: 'recompte' is no protection; one of recompute, keep, wrong, or a table",
    "fault.4.change.0: message RANGE has no signal 'pseudorang_m'; did you mean 'pseudorange_m'?",
    "fault.4.change.1: signal SV_Z.health has no value 'UNHELTHY'; did you mean 'UNHEALTHY'?",
)


def test_every_mistake_of_a_file_is_told_in_one_go(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(BAD)
    with pytest.raises(FaultError) as caught:
        files.load(path)
    told = str(caught.value).splitlines()
    assert len(told) == len(LINES)
    for line, words in zip(told, LINES, strict=True):
        assert line.startswith(f"{path}: {words}"), line


def test_mistakes_of_files_and_lines_are_told_together(tmp_path):
    (tmp_path / "a.toml").write_text('[[fault]]\nkind = "los"\n')
    (tmp_path / "b.toml").write_text("fault = []\n")
    with pytest.raises(FaultError) as caught:
        files.gathered([tmp_path / "a.toml", tmp_path / "b.toml"], ["rx2 of"])
    told = str(caught.value).splitlines()
    assert ["a.toml" in told[0], "b.toml" in told[1], "--fault" in told[2]] == [True] * 3 and len(told) == 3


@pytest.mark.parametrize("name", ["loss", "length", "counter"])
def test_an_unknown_key_is_told_by_those_of_its_kind(name):
    with pytest.raises(FaultError) as caught:
        files.FILES.checked({"fault": [{"kind": name, "on": "rx2", "colour": "red", "lag": 3}]}, "x")
    own = ", ".join(KINDS[name].params.model_fields)
    assert str(caught.value).splitlines() == [
        f"x: fault.0.{key}: unknown key; allowed are {own}" for key in ("colour", "lag")
    ]


def test_a_file_may_have_lines():
    given = files.FILES.checked({"fault": ["rx2 off @2m+30s", {"kind": "loss", "on": "ATT"}]}, "x")
    assert [one.kind for one in given.fault] == ["receiver-off", "loss"]


def test_a_scenario_may_have_faults():
    given = scenario.parse({**document(), "fault": ["rx2 off @2m+30s"]}, "test")
    again = scenario.parse(given.model_dump(mode="json", exclude_none=True), "test")
    assert again == given and given.fault[0].kind == "receiver-off"


def test_the_library_has_a_file_for_each_kind_that_a_link_can_do():
    shown = {fault.kind for path in files.shipped().values() for fault in files.load(path).fault}
    assert shown == {row.name for row in KINDS.values() if row.links}


@pytest.mark.parametrize("name", files.shipped())
def test_shipped_files_can_be_armed_and_expect_something(name):
    found = files.load(files.shipped()[name])
    assert found.description and all(one.expect.model_fields_set for one in found.fault)
    links = [link for link in LINKS if all(link in KINDS[one.kind].links for one in found.fault)]
    for link in links:
        engine.armed(found.fault, "soyuz", VEHICLE, CODEC, NS, 1, link=link)
    assert links, "some link can do it"
