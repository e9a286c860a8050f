"""Values as the command line has them: read back they are what they were."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import gnss_hil
from gnss_hil.tools.bench.arguments import toml_value, words

plain = st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
texts = st.text(st.characters(exclude_categories=["Cs"]))
values = st.recursive(
    (plain | texts).filter(lambda value: value is not None),
    lambda inner: st.lists(inner) | st.dictionaries(texts, inner),
    max_leaves=8,
)


@given(values)
def test_a_value_is_read_back_as_it_was(value):
    assert tomllib.loads(f"x = {toml_value(value)}") == {"x": value}


def test_paths_are_texts_and_tuples_are_lists():
    assert toml_value({"file": Path("a b.nav"), "at": (1, 2.5)}) == '{"file" = "a b.nav", "at" = [1, 2.5]}'


NOTHING = {
    **dict.fromkeys(("duration", "interval", "seed", "pace", "bus", "policy", "navigator", "vehicle")),
    **dict.fromkeys(("autonomous", "obs", "reference", "flight", "emulator")),
    **dict.fromkeys(("nav", "sp3", "on", "off", "faults"), ()),
    "options": {}, "set": {}, "ionosphere_free": False,
}  # fmt: skip


def test_what_is_not_said_is_no_word():
    assert words("soyuz", NOTHING) == ["soyuz"]


def test_programs_and_faults_are_told_apart_by_what_they_are():
    said = words(
        Path("a.toml"),
        {
            **NOTHING, "flight": ["./my fsw", Path("x")], "emulator": "external", "duration": "10m",
            "faults": ["rx2 off @2m+30s", "many.toml", Path("more")], "options": {"flag": True, "x": 1.5},
        },
    )  # fmt: skip
    assert said == [
        "a.toml", "--duration=10m", "--option=flag=true", "--option=x=1.5", "--fault=rx2 off @2m+30s",
        "--faults=many.toml", "--faults=more", "--flight='./my fsw' x", "--emulator=external",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["nav", "sp3", "on", "off", "faults"])
def test_a_word_where_a_list_is_wanted_is_told(name):
    with pytest.raises(gnss_hil.BenchError, match=rf"{name}='x': a list of them, as in {name}=\['x'\]"):
        words("soyuz", {**NOTHING, name: "x"})
