"""pytest-gnss-hil: the fixture `bench`, by which a test plays runs and looks at what they showed.

    def test_a_silent_receiver_is_noticed(bench):
        run = bench.run("soyuz", faults=["rx2 off @2m+30s"])
        assert run.detected("silence", within=2)
        assert run.fix_error_m.max() < 5

Nothing of the bench is imported before a test asks for the fixture.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

_PLAYED = pytest.StashKey[Any]()
"""The `Bench` of a test."""

_FAILED = pytest.StashKey[bool]()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("gnss-hil", "gnss-hil: runs of the bench")
    group.addoption(
        "--gnss-hil-keep", action="store_true",
        help="keep the run folders of tests that pass, too; they are below tmp_path (--basetemp)",
    )  # fmt: skip
    group.addoption(
        "--gnss-hil-bus", default="embedded", metavar="BUS",
        help="bus of runs that name none: embedded (default), inline (fastest; another's software has "
        "embedded all the same), socketcan:vcan0, ...",
    )  # fmt: skip


@pytest.fixture
def bench(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Any]:
    """A `gnss_hil.Bench`: `bench.run(...)` takes what `gnss_hil.run` takes and returns a `gnss_hil.Run`. Run
    folders are below tmp_path, and kept where the test fails."""
    import gnss_hil

    played = gnss_hil.Bench(tmp_path, bus=str(request.config.getoption("--gnss-hil-bus")))
    request.node.stash[_PLAYED], request.node.stash[_FAILED] = played, False
    yield played
    if not (request.node.stash[_FAILED] or request.config.getoption("--gnss-hil-keep")):
        played.discard()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed and _PLAYED in item.stash:
        item.stash[_FAILED] = True
        if folders := item.stash[_PLAYED].played:
            report.sections.append(("gnss-hil", _said(folders)))
            item.user_properties += [("gnss-hil run folder", str(folder)) for folder in folders]
    return report


def _said(folders: list[Path]) -> str:
    """What the report of a failure says of the runs; of a fault of ours too, or it would end the session."""
    from gnss_hil.tools.bench import failure

    try:
        return failure.text(folders)
    except Exception as error:
        return "\n".join([*map(str, folders), f"{type(error).__name__}: {error}"])
