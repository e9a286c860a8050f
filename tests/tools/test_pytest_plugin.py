"""pytest-gnss-hil in sessions of its own: the fixture, what is kept, what the report of a failure says."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gnss_hil.tools import pytest_plugin
from tests.support.programs import ROOT

pytestmark = pytest.mark.verifies(
    "tools/pytest_plugin.py",
    "tools/bench/fixture.py",
    "tools/bench/failure.py",
    what="The pytest plugin",
    by="pytest's own tester",
    status="modelled",
)

NAME = pytest_plugin.__name__


@pytest.fixture
def session(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch):
    """Plays a file of tests in a process of its own, with this plugin by its name: what an installed one
    would load may be older than this checkout."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")

    def play(text: str, *words: str) -> pytest.RunResult:
        pytester.makepyfile(text)
        return pytester.runpytest_subprocess("-p", NAME, "--gnss-hil-bus", "inline", *words)

    return play


def test_the_package_offers_it():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {"gnss-hil": NAME}
    assert {requirement.partition(">")[0] for requirement in project["optional-dependencies"]["bench"]} == {
        "polars", "pytest",
    }  # fmt: skip


def folders(pytester: pytest.Pytester) -> dict[str, Path]:
    """Run folders that were kept, by test and name."""
    found = (pytester.path / "base").glob("test_*0/*/summary.json")
    return {f"{file.parent.parent.name[:-1]}/{file.parent.name}": file.parent for file in sorted(found)}


PASSES_AND_FAILS = """
    import gnss_hil

    def test_passes(bench, tmp_path):
        run = bench.run("soyuz", duration=5)
        assert isinstance(bench, gnss_hil.Bench) and isinstance(run, gnss_hil.Run)
        assert run.folder == tmp_path / "soyuz" and len(run.epochs) == 5

    def test_fails(bench):
        bench.run("soyuz", duration=5, seed=4)
        second = bench.run("soyuz", duration=4, bus="embedded")
        assert second.detected("silence", where="RX2")

    def test_without_the_bench():
        assert False
"""


def test_a_failure_names_its_runs_and_keeps_them(session, pytester):
    done = session(PASSES_AND_FAILS, "--basetemp", "base", "--junitxml", "verdict.xml")
    done.assert_outcomes(passed=1, failed=2)
    kept = folders(pytester)
    assert set(kept) == {"test_fails/soyuz", "test_fails/soyuz-2"}
    text = done.stdout.str()
    assert text.count("- gnss-hil -") == 1
    first, second = kept.values()
    done.stdout.fnmatch_lines([
        f"run folder  {first}", "again       gnss-hil run soyuz --duration=5 --seed=4 --bus=inline",
        f"report      {first}/report.html", "ended       complete",
        "checks      too_few_satellites at FLIGHT: 5 epochs, first at 00:00:00", "",
        f"run folder  {second}", "again       gnss-hil run soyuz --duration=4 --bus=embedded",
    ])  # fmt: skip
    assert all((folder / "report.html").stat().st_size > 100_000 for folder in kept.values())
    cases = ElementTree.parse(pytester.path / "verdict.xml").getroot().iter("testcase")
    properties = {case.get("name"): [p.get("value") for p in case.iter("property")] for case in cases}
    assert properties.pop("test_fails") == [str(folder) for folder in kept.values()]
    assert properties == {"test_passes": [], "test_without_the_bench": []}


def test_what_passes_is_kept_if_asked(session, pytester):
    done = session(PASSES_AND_FAILS, "--basetemp", "base", "--gnss-hil-keep", "-k", "test_passes")
    done.assert_outcomes(passed=1)
    assert set(folders(pytester)) == {"test_passes/soyuz"}


def test_mistakes_and_broken_runs_are_the_tests_own_line(session, pytester):
    done = session(
        """
        import sys

        def test_mistake(bench):
            bench.run("soyuz", duration=-5)

        def test_flight_software_that_never_came(bench):
            bench.run("soyuz", duration=5, flight=[sys.executable, "-c", "print('I will not')"])

        def test_damaged(bench):
            run = bench.run("soyuz", duration=5)
            (run.folder / "checks.parquet").write_bytes(b"nothing")
            assert False
        """,
        "--basetemp", "base", "--tb", "short",
    )  # fmt: skip
    done.assert_outcomes(failed=3)
    text = done.stdout.str()
    assert "E   gnss_hil.BenchError: --duration: -5 s; must be finite and greater than 0" in text
    assert "E   gnss_hil.BenchError: flight software of soyuz ended with status 0" in text
    assert "I will not" in text
    assert not re.search(r"bench[/\\](fixture|run|errors)\.py", text)
    assert re.search(r"record      .*checks\.parquet: ", text)


def test_inline_is_for_our_own_two_sides(session):
    session(
        """
        import sys

        def test_buses(bench):
            for asked, bus in (({}, "inline"), ({"pace": "x50"}, "embedded"), ({"flight": "ours"}, "inline"),
                               ({"flight": ["a"]}, "embedded"), ({"emulator": "external"}, "embedded")):
                assert bench._bus(asked) == bus, asked
            assert bench.run("soyuz", duration=3).summary["bus"]["interface"] == "inline"
            named = bench.run("soyuz", duration=3, bus="embedded")
            assert named.summary["bus"]["interface"] == "embedded"
        """
    ).assert_outcomes(passed=1)


def test_the_example_passes(session, pytester):
    example = ROOT / "examples" / "bench_tests" / "test_example.py"
    session(example.read_text("utf-8")).assert_outcomes(passed=7)


def test_runs_of_tests_side_by_side_have_folders_of_their_own(session, pytester):
    text = "import pytest\n@pytest.mark.parametrize('n', [1, 2, 3])\ndef test_one(bench, n):\n    run = bench"
    done = session(
        f"{text}.run('soyuz', duration=3 + n)\n    assert len(run.epochs) == 3 + n\n    assert n < 3",
        "-p", "xdist", "-n", "2", "--basetemp", "base",
    )  # fmt: skip
    done.assert_outcomes(passed=2, failed=1)
    (kept,) = (pytester.path / "base").glob("popen-gw*/test_one_3_0/soyuz")
    assert f"run folder  {kept}" in done.stdout.str()


def test_our_own_tests_run_with_it(pytester, monkeypatch):
    """The settings of this project, with the plugin loaded as in an environment in which it is installed."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.chdir(ROOT)
    done = pytester.runpytest_subprocess(
        "-p", NAME, "-p", "xdist", "-c", ROOT / "pyproject.toml", "--rootdir", ROOT, "-q",
        "tests/tools/common/test_whole_file.py",
    )  # fmt: skip
    assert done.ret == 0


def test_the_command_line_in_a_report_is_one(session, pytester):
    text = (
        "def test_it(bench):\n    bench.run('soyuz', duration=4, set={'description': \"it's\"})\n    assert 0"
    )
    done = session(text, "--basetemp", "base")
    (line,) = re.findall(r"^again +(.*)$", done.stdout.str(), re.M)
    assert shlex.split(line) == [
        "gnss-hil", "run", "soyuz", "--duration=4", "--bus=inline", "--set=description=it's",
    ]  # fmt: skip


def test_a_failure_tells_what_faults_did(session):
    done = session(
        """
        def test_it(bench):
            missed = "rx2 off @5s+3s detected_by=mark"
            run = bench.run("soyuz", duration=12, faults=[missed, "rx1 HEARTBEAT loss @9s n=1"])
            assert not run.detected("silence")
        """
    )
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(
        [
            "again       gnss-hil run soyuz --duration=12 --bus=inline '--fault=rx2 off @5s+3s *",
            "missed      expectation missed: fault 'receiver-off 1' (rx2, craft soyuz): detected_by: *",
            "faults      receiver-off 1 at rx2: epochs 5 to 7, * frames touched",
            "            loss 2 at rx1 HEARTBEAT: epochs 9 to *, 1 frame touched",
            "checks      too_few_satellites at FLIGHT: 12 epochs, first at 00:00:00",
            "            silence at RX2: * epochs, first at 00:00:05",
        ]
    )


def test_a_folder_that_a_test_names_is_left_alone(session, pytester):
    mine = pytester.path / "mine"
    mine.mkdir()
    (mine / "precious").touch()
    done = session(
        f"""
        import gnss_hil, pytest

        def test_taken(bench):
            with pytest.raises(gnss_hil.BenchError, match="exists and is not an empty folder"):
                bench.run("soyuz", duration=5, out={str(mine)!r})

        def test_named(bench, tmp_path):
            named = bench.run("soyuz", duration=5, out={str(pytester.path / "named")!r})
            names = [bench.run(scenario, duration=3).folder for scenario in ("soyuz-roll", "soyuz", "soyuz")]
            assert names == [tmp_path / name for name in ("soyuz-roll", "soyuz", "soyuz-2")]

        def test_taken_and_failing(bench):
            with pytest.raises(gnss_hil.BenchError):
                bench.run("soyuz", duration=5, out={str(mine)!r})
            assert False
        """,
        "--basetemp", "base",
    )  # fmt: skip
    done.assert_outcomes(passed=2, failed=1)
    assert (mine / "precious").exists()
    assert (pytester.path / "named" / "summary.json").exists()
    assert not folders(pytester)
    assert "run folder  " not in done.stdout.str()
