"""The page of results: every row has a command that exists and figures that its cells show."""

from __future__ import annotations

import shlex

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import COMMANDS, parser_of
from tests.results import kept, page, table
from tests.results.__main__ import measure, play, shell_text
from tests.results.kept import Kept
from tests.results.readers import POSITION, errors_m, printed
from tests.results.table import RESULTS, Result


def test_names_are_different():
    assert len(RESULTS) == sum(len(section.results) for section in table.SECTIONS)


@pytest.mark.parametrize("name", RESULTS)
def test_cells_show_figures(name):
    result = RESULTS[name]
    shown = [cell.format(**dict.fromkeys(result.figures, page.Figure(1.5))) for cell in result.cells]
    assert all(shown)
    (section,) = (one for one in table.SECTIONS if result in one.results)
    assert len(section.heads) == 1 + len(result.cells)


@pytest.mark.parametrize("name", RESULTS)
def test_our_commands_are_as_the_command_line_takes_them(name, tmp_path):
    for line in shell_text(RESULTS[name].command, tmp_path).splitlines():
        words = shlex.split(line)
        if words[0] == "gnss-hil" and words[1] in COMMANDS:
            parser_of(COMMANDS[words[1]]).parse_args(words[2:])


@pytest.mark.parametrize(
    "metres, text",
    [(0.73, "0.73 m"), (12.34, "12.3 m"), (7.2e-5, "72 um"), (0.00295, "2.95 mm"), (0.0, "0 um")],
)
def test_lengths_have_the_unit_of_their_size(metres, text):
    assert f"{page.Figure(metres):length}" == text


def test_what_is_kept_is_of_the_table():
    for name, row in kept.read().items():
        assert set(row.figures) == set(RESULTS[name].figures), name
        assert np.isfinite(list(row.figures.values())).all(), name


def test_a_run_is_measured(tmp_path):
    result = Result(
        "short", "a short run", "gnss-hil run soyuz --bus inline --duration 60",
        {**table.some("fixes", "epochs", "max_m"), "worst_m": table.worst_m(0, 60)}, ("{fixes:.0f}",),
    )  # fmt: skip
    figures, output = measure(result)
    assert output == ""
    assert figures["epochs"] == 60 and 20 <= figures["fixes"] < 60
    assert figures["worst_m"] == pytest.approx(figures["max_m"], rel=1e-6)


def test_a_failure_is_one(tmp_path):
    with pytest.raises(RuntimeError, match="exit status 2"):
        play("gnss-hil run no-such-scenario", tmp_path / "run")


def test_what_a_command_prints_and_costs(tmp_path):
    played = play('python -c \'b"x" * 200_000_000; print("found 1 234.5 m")\'', tmp_path / "run")
    assert printed(r"found ([\d. ]+) m")(played) == 1234.5
    assert played.peak_mb > 190 and played.cpu_s > 0
    with pytest.raises(ValueError, match="no match"):
        printed("nothing")(played)


def test_errors_of_a_stretch(tmp_path):
    """Epochs of 10 s: fixes off by their number of metres, the third without a fix."""
    import polars as pl

    times = {"t_gps_s": [1000.0, 1010.0, 1020.0, 1030.0]}
    fixes = {**times, "valid": [True, True, False, True], **dict.fromkeys(POSITION, [0.0] * 4)}
    fixes[POSITION[1]] = [0.0, 1.0, 2.0, 3.0]
    pl.DataFrame(fixes).write_parquet(tmp_path / "fixes.parquet")
    pl.DataFrame({**times, **dict.fromkeys(POSITION, [0.0] * 4)}).write_parquet(tmp_path / "truth.parquet")
    errors, missing = errors_m(tmp_path, 10, 30)
    assert errors == pytest.approx([1.0]) and missing == 1


def test_page_says_what_is_old_and_what_is_missing():
    result = RESULTS["help"]
    old = Kept("2026-01-02", "abc1234", "a machine", 0.1, "gnss-hil", {"elapsed_s": 0.07})
    text = page.page({"help": old})
    assert f"| {result.what} | 0.07 s | 2026-01-02, abc1234, by another command |" in text
    assert text.count(page.NONE) == len(RESULTS) - 1
    assert "- a machine" in text
    assert all(line in text for one in RESULTS.values() for line in one.command.splitlines())


def test_kept_figures_are_written_and_read(tmp_path):
    rows = {"help": kept.measured("gnss-hil --help", {"elapsed_s": 0.123456789}, 1.26)}
    kept.write(rows, tmp_path / "results.json")
    assert kept.read(tmp_path / "results.json") == rows
    assert rows["help"].figures == {"elapsed_s": 0.123457} and rows["help"].load == 1.3
