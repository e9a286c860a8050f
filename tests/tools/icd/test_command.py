"""`gnss-hil icd` as people type it."""

from __future__ import annotations

import os
import pty
import re
import subprocess
from pathlib import Path

import pytest

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main
from tests.support.icd_pages import page
from tests.support.programs import PROGRAM
from tests.support.waiting import HANG_S


@pytest.mark.parametrize(
    "argv", ["icd --html", "icd html", "icd html soyuz", "icd --html soyuz --receivers 4"]
)
def test_into_a_pipe_goes_the_page(argv, capsys):
    assert main(argv.split()) == 0
    assert capsys.readouterr().out == page()


@pytest.mark.slow
def test_on_a_terminal_the_page_goes_to_a_file(tmp_path):
    ours, theirs = pty.openpty()
    done = subprocess.run(
        [PROGRAM, "icd", "--html"], cwd=tmp_path, stdout=theirs, stderr=theirs, timeout=HANG_S
    )
    os.close(theirs)
    written = os.read(ours, 4096).decode()
    os.close(ours)
    assert done.returncode == 0
    assert written.strip() == "interface control document: gnss-hil-icd.html"
    assert (tmp_path / "gnss-hil-icd.html").read_text("utf-8") == page()


def test_out_names_the_file(tmp_path, capsys):
    path = tmp_path / "six.html"
    assert main(["icd", "--html", "--receivers", "6", "--out", str(path)]) == 0
    assert capsys.readouterr().out == f"interface control document: {path}\n"
    assert 'id="RX6_RANGE"' in path.read_text("utf-8")
    assert 'id="RX7_RANGE"' not in path.read_text("utf-8")


@pytest.mark.parametrize(
    ("argv", "line"),
    [
        ("icd", "icd: a part is missing; allowed are html, dbc, hash, budget .*"),
        ("icd htlm", "icd: no part 'htlm'; allowed are html, dbc, hash, budget"),
        ("icd --html dbc", "icd dbc and --html: one of the two"),
        ("icd --html soyuz extra", "icd --html takes one scenario, found 'soyuz' and 'extra'"),
        ("icd html soyuz --receivers 2", "soyuz: its craft have 4 receivers, not --receivers 2"),
        ("icd dbc --out x", "icd dbc writes to standard output; --out is for html"),
        ("icd --html nowhere", "scenario 'nowhere': not found; shipped are .*"),
        ("icd --html --receivers 9", "--receivers: 9 receivers; a contract has 1 to 8.*"),
        ("icd dbc soyuz", "icd dbc takes no scenario, found 'soyuz'"),
    ],
)
def test_mistakes_get_one_line(argv, line, capsys):
    assert main(argv.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(f"gnss-hil: {line}\n", err), err


@pytest.fixture
def two_craft(tmp_path) -> Path:
    """A scenario with a craft of four receivers and one of two."""
    whole = shipped()["soyuz"].read_text("utf-8")
    craft = whole[whole.index("[[craft]]") :].replace('name = "soyuz"', 'name = "other"')
    path = tmp_path / "two.toml"
    path.write_text(whole + craft.replace('vehicle = "soyuz-ms.toml"', 'vehicle = "pair.toml"'), "utf-8")
    antennas = find("soyuz-ms").read_text("utf-8").split("[[antenna]]")
    vehicle = "[[antenna]]".join(antennas[:3]).replace('name = "soyuz-ms"', 'name = "pair"')
    (tmp_path / "pair.toml").write_text(vehicle, "utf-8")
    return path


def test_craft_with_different_receivers_need_a_choice(two_craft, capsys):
    assert main(["icd", "--html", str(two_craft)]) == 2
    assert capsys.readouterr().err == (
        f"gnss-hil: {two_craft}: its craft have 2 and 4 receivers; choose with --receivers N\n"
    )
    assert main(["icd", "--html", str(two_craft), "--receivers", "2"]) == 0
    page_ = capsys.readouterr().out
    assert "Craft other, vehicle pair" in page_
    assert "Craft soyuz" not in page_
    assert 'id="RX2_RANGE"' in page_
    assert 'id="RX3_RANGE"' not in page_


def test_a_file_that_cannot_be_written_is_named(tmp_path, capsys):
    path = tmp_path / "no" / "where.html"
    assert main(["icd", "--html", "--out", str(path)]) == 2
    assert capsys.readouterr().err == f"gnss-hil: --out {path}: no such folder {path.parent}\n"
