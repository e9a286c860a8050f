"""Wheel and sdist as hatchling builds them, and the wheel as somebody installs it."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[3]


def built(kind, source, target):
    """Path of the wheel or sdist of a source tree."""
    target.mkdir()
    subprocess.run(
        [sys.executable, "-c", f"import hatchling.build as h; h.build_{kind}({str(target)!r})"],
        cwd=source, check=True,
    )  # fmt: skip
    (found,) = target.iterdir()
    return found


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built("wheel", ROOT, tmp_path_factory.mktemp("wheel") / "dist")


def contents(path):
    with zipfile.ZipFile(path) as archive:
        return {entry.filename: entry.CRC for entry in archive.infolist()}


def test_a_wheel_has_one_package(wheel):
    names = contents(wheel)
    assert {name.partition("/")[0] for name in names} == {"gnss_hil", "gnss_hil-0.1.0.dist-info"}
    assert {name.split("/")[1] for name in names if name.startswith("gnss_hil/") and name.count("/") > 1} == {
        "dbc", "emulator", "flightsw", "tools",
    }  # fmt: skip
    assert {"gnss_hil/__init__.py", "gnss_hil/py.typed", "gnss_hil/contract.md"} <= set(names)
    assert "gnss_hil/__init__.pyi" in names
    with zipfile.ZipFile(wheel) as archive:
        offered = archive.read("gnss_hil-0.1.0.dist-info/entry_points.txt").decode()
    assert "[pytest11]\ngnss-hil = gnss_hil.tools.pytest_plugin\n" in offered
    assert {"gnss_hil/dbc/contract/gnss.dbc", "gnss_hil/tools/report/plotly.min.js.gz"} <= set(names)
    assert not [name for name in names if "packaging" in name or Path(name).name.startswith("test_")]


@pytest.mark.slow
def test_a_sdist_builds_the_same_wheel(wheel, tmp_path):
    sdist = built("sdist", ROOT, tmp_path / "dist")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    again = built("wheel", tmp_path / sdist.name.removesuffix(".tar.gz"), tmp_path / "again")
    assert contents(again) == contents(wheel)


def brought_by(requirements: list[str]) -> dict[str, Distribution]:
    """What an installer brings for these requirements: their distributions, and what those require."""
    found: dict[str, Distribution] = {}
    waiting = [Requirement(text) for text in requirements]
    while waiting:
        wanted = waiting.pop()
        name = wanted.name.lower().replace("_", "-")
        for extra in ("", *wanted.extras):
            key = f"{name}[{extra}]"
            if key in found or (wanted.marker and not wanted.marker.evaluate({"extra": ""})):
                continue
            found[key] = distribution(wanted.name)
            inner = (Requirement(text) for text in found[key].requires or ())
            waiting += [r for r in inner if r.marker is None or r.marker.evaluate({"extra": extra})]
    return found


def lend(requirements: list[str], place: Path) -> None:
    """Links to all that these requirements bring, and to nothing else of this environment."""
    for found in brought_by(requirements).values():
        for top in {
            file.parts[0] for file in found.files or () if file.parts[0] not in ("..", "__pycache__")
        }:
            if not (place / top).exists():
                (place / top).symlink_to(Path(str(found.locate_file(top))))


@pytest.mark.slow
def test_an_installed_wheel_runs(wheel, tmp_path):
    """In an environment of its own, with what its dependencies bring and none of the developers' packages."""
    venv.create(tmp_path / "venv", with_pip=False, symlinks=True)
    python = tmp_path / "venv" / "bin" / "python"
    place = subprocess.run(
        [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
        check=True, capture_output=True, text=True,
    ).stdout.strip()  # fmt: skip
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(place)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    lend(project["dependencies"], Path(place))

    def run(code, *arguments):
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        return subprocess.run(
            [python, "-c", code, *arguments], cwd=tmp_path, env=environment,
            check=True, capture_output=True, text=True,
        ).stdout  # fmt: skip

    developers = [Requirement(text).name for text in project["optional-dependencies"]["dev"]]
    spec = (
        "import sys; from importlib.util import find_spec; print([n for n in sys.argv[1:] if find_spec(n)])"
    )
    assert run(spec, *developers) == "[]\n"
    assert run("import gnss_hil; print(gnss_hil.__file__)").startswith(place)
    command = "import sys; from gnss_hil.tools.command_line.main import main; sys.exit(main())"
    assert "soyuz" in run(command, "scenarios")
    assert "contract" in run(command, "icd", "--html").lower()
    out = str(tmp_path / "run")
    run(command, "run", "soyuz", "--duration", "3", "--quiet", "--out", out)
    assert Path(out, "report.html").is_file()
    plugin = "from can.interfaces import BACKENDS; print(BACKENDS['gnss-hil'])"
    assert "gnss_hil.dbc.bus.plugin" in run(plugin)
