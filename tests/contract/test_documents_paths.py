"""What the documents point to exists: links, files of the repository, our commands and their options."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import gnss_hil
from gnss_hil.tools.command_line.main import COMMANDS, parser_of

ROOT = Path(__file__).parents[2]
HISTORY = "CHANGELOG.md"
DOCUMENTS = sorted(
    path.relative_to(ROOT).as_posix()
    for place in ("*.md", "docs/*.md", "docs/verification/*.md", "examples/*/README.md")
    for path in ROOT.glob(place)
)
PLACES = ("dbc/", "emulator/", "flightsw/", "tools/", "tests/", "examples/", "docs/")


def text_of(name: str) -> str:
    return (ROOT / name).read_text("utf-8")


@pytest.mark.parametrize("name", DOCUMENTS)
def test_links_lead_somewhere(name):
    for target in re.findall(r"\]\((?!https?:)([^)#\s]+)(?:#[^)]*)?\)", text_of(name)):
        assert ((ROOT / name).parent / target).exists(), target


@pytest.mark.parametrize("name", [name for name in DOCUMENTS if name != HISTORY])
def test_files_that_are_named_exist(name):
    for place in re.findall(r"`([\w./-]+?)(?:::\w+)?`", text_of(name)):
        if place.startswith(PLACES) and "/build/" not in place and "NAME" not in place:
            assert (ROOT / place).exists(), place


@pytest.mark.parametrize("name", [name for name in DOCUMENTS if name != HISTORY])
def test_commands_are_as_the_command_line_takes_them(name):
    text = text_of(name).replace("\\\n", " ")
    for line in re.findall(r"^(?: {4}|)\$? ?(gnss-hil .*?)(?: +#.*)?$", text, re.M):
        command = line.split()[1]
        if command in COMMANDS and command != "vcan" and "[" not in line:
            words = shlex.split(re.split(r" [|>&]", line)[0])
            parser_of(COMMANDS[command]).parse_args(words[2:])


def test_modules_that_are_named_exist():
    for name in DOCUMENTS:
        if name == HISTORY:
            continue
        for module in re.findall(r"`(?:python -m )?gnss_hil\.([\w.]+)`", text_of(name)):
            name, _, attribute = module.partition(".")
            if name in gnss_hil.__all__:  # what programs use, without the rooms of the house
                assert not attribute or hasattr(getattr(gnss_hil, name), attribute), module
                continue
            place = ROOT / module.replace(".", "/")
            assert place.is_dir() or any(p.with_suffix(".py").exists() for p in (place, place.parent)), module
