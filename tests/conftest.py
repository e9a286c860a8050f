"""Settings for every test."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import HealthCheck, settings

pytest_plugins = ["pytester"]

# Machines are noisy: no test fails on a time, that of drawing examples included, in which hypothesis makes
# its tables of characters when it is first used. Derandomised, so that a red run is red again.
settings.register_profile(
    "bench", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("bench")

SHARING = {"system", "realdata", "peers"}
"""Folders whose modules share a costly run among their tests: each module is played by one process."""

USUAL = 5.0
"""Seconds of a slow test that does not say: they give an order, and nothing is judged by them."""

_own = pytest.StashKey[str]()


def pytest_configure(config: pytest.Config) -> None:
    """A temporary folder for this process, inherited by all that it starts: buses of other benches that run
    on the machine are not seen, and none of ours is left behind. Its name is short, as sockets' paths are."""
    # Behind `nohup`, or in the background of a script, signals are ignored, which what is started inherits.
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    usual = os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())
    config.stash[_own] = tempfile.mkdtemp(prefix="gh-", dir=usual)
    os.environ["TMPDIR"] = tempfile.tempdir = config.stash[_own]


def pytest_unconfigure(config: pytest.Config) -> None:
    shutil.rmtree(config.stash[_own], ignore_errors=True)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """For several processes: what takes longest first, so that nothing long is the last and alone; one
    user-mode kernel at a time, which takes two gigabytes."""
    for item in items:
        if "uml" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("user-mode kernel"))
        elif item.path.parent.name in SHARING:
            item.add_marker(pytest.mark.xdist_group(item.path.name))
    cost = Counter[str]()
    for item in items:
        cost[_unit(item)] += _seconds(item)
    items.sort(key=lambda item: -cost[_unit(item)])


def _unit(item: pytest.Item) -> str:
    """What is played in one go by one process: the group of a test, or the test."""
    group = item.get_closest_marker("xdist_group")
    return group.args[0] if group else item.nodeid


def _seconds(item: pytest.Item) -> float:
    """Of processor time or waiting, as its marker says; USUAL where that names none."""
    slow = item.get_closest_marker("slow")
    if slow:
        return slow.kwargs.get("seconds", USUAL)
    return 1.0 if item.path.parent.name in SHARING else 0.0


@pytest.fixture(autouse=True)
def _own_temporary_folder(pytestconfig: pytest.Config) -> Iterator[None]:
    """A temporary folder for each test: it sees no bus and no leftover of another. Its patches are its own,
    undone after those of the test."""
    folder = tempfile.mkdtemp(prefix="", dir=pytestconfig.stash[_own])
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("TMPDIR", folder)
        patched.setattr(tempfile, "tempdir", folder)
        yield
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
