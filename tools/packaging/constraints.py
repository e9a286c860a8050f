"""Versions for installs: those that the bench was tested with, and the lowest that it declares.

python tools/packaging/constraints.py             writes constraints.txt: what is installed here
python tools/packaging/constraints.py --lowest    prints the declared minima, for pip install -c
"""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

HERE = Path(__file__).resolve().parent
PROJECT, PINS = HERE.parents[1] / "pyproject.toml", HERE / "constraints.txt"
NAME = "gnss-hil"

_HEAD = """\
# What the bench was tested with: every package that it needs at run time, directly or not.
#     pip install -c tools/packaging/constraints.txt .
# Written by tools/packaging/constraints.py.
"""


def declared(extras: bool = False) -> list[Requirement]:
    """The dependencies of pyproject.toml, with `extras` the developers' tools and the builder's, too."""
    project = tomllib.loads(PROJECT.read_text("utf-8"))
    lines = list(project["project"]["dependencies"])
    if extras:
        lines += [line for more in project["project"]["optional-dependencies"].values() for line in more]
        lines += project["build-system"]["requires"]
    return [Requirement(line) for line in lines]


def runtime() -> dict[str, Distribution]:
    """By name, what is installed of all that the bench needs at run time on this machine."""
    found: dict[str, Distribution] = {}
    rest = declared()
    while rest:
        wanted = rest.pop()
        name = canonicalize_name(wanted.name)
        if name in found:
            continue
        found[name] = distribution(name)
        for line in found[name].requires or ():
            further = Requirement(line)
            asked = ("", *wanted.extras)
            if further.marker is None or any(further.marker.evaluate({"extra": extra}) for extra in asked):
                rest.append(further)
    return dict(sorted(found.items()))


def pins() -> dict[str, str]:
    """Name to version, of constraints.txt."""
    lines = (line.partition("#")[0].strip() for line in PINS.read_text("utf-8").splitlines())
    pairs = (line.split("==") for line in lines if line)
    return {canonicalize_name(name): version for name, version in pairs}


def lowest() -> list[str]:
    """`name==version` of each declared minimum, for pip."""
    minima = {str(r): re.fullmatch(r"([\w.-]+)>=([\w.]+)", str(r)) for r in declared(extras=True)}
    unknown = [text for text, found in minima.items() if found is None]
    if unknown:
        raise ValueError(f"not of the form NAME>=VERSION: {', '.join(unknown)}")
    return sorted(f"{found[1]}=={found[2]}" for found in minima.values() if found)


def main(argv: list[str]) -> None:
    if argv == ["--lowest"]:
        print("\n".join(lowest()))
    elif argv:
        sys.exit(__doc__)
    else:
        lines = [f"{name}=={found.version}\n" for name, found in runtime().items()]
        PINS.write_text(_HEAD + "".join(lines), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
