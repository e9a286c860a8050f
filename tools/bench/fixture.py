"""What a test is handed as `bench`: runs in folders of its own, remembered for the report of its failure."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from inspect import Parameter, signature
from itertools import chain, count
from os import fspath
from pathlib import Path
from typing import Any, Concatenate, ParamSpec

from gnss_hil.tools.bench.errors import BenchError
from gnss_hil.tools.bench.record import Run
from gnss_hil.tools.bench.run import run

_P = ParamSpec("_P")
_Method = Callable[Concatenate["Bench", _P], Run]


def _like(function: Callable[_P, Run]) -> Callable[[Callable[..., Run]], _Method[_P]]:
    """A method that takes what a function takes."""
    own = Parameter("self", Parameter.POSITIONAL_ONLY)
    whole = signature(function)
    theirs = [p.replace(default=False) if p.name == "report" else p for p in whole.parameters.values()]

    def typed(method: Callable[..., Run]) -> _Method[_P]:
        method.__doc__ = f"As `gnss_hil.run`, without a report unless asked for.\n\n{function.__doc__}"
        vars(method)["__signature__"] = whole.replace(parameters=[own, *theirs])
        return method

    return typed


@dataclass(eq=False, repr=False)
class Bench:
    """Plays runs for one test.

    folder   below which the run folders are: SCENARIO, SCENARIO-2, ...
    bus      of runs that name none. "inline" is for our own two sides in lockstep; other runs are "embedded"
    played   folders of the runs so far, of those that failed too
    own      those of them that were made below `folder`; what `out` names is the test's own business
    """

    folder: Path
    bus: str = "embedded"
    played: list[Path] = field(default_factory=list)
    own: list[Path] = field(default_factory=list)

    def __repr__(self) -> str:
        return f"Bench({str(self.folder)!r})"

    @_like(run)
    def run(self, scenario="soyuz", *, out=None, bus=None, report=False, **asked: Any) -> Run:
        place = self._unused(Path(fspath(scenario)).stem) if out is None else Path(out)
        self.own += [place] if out is None else []
        __tracebackhide__ = True  # pytest: the test's own line is what is wrong
        try:
            made = run(scenario, out=place, bus=bus or self._bus(asked), report=report, **asked)
        except BenchError as error:
            self.played += [error.folder] if error.folder else []
            raise error.with_traceback(None) from None
        self.played.append(made.folder)
        return made

    def _unused(self, name: str) -> Path:
        names = (f"{name}{suffix}" for suffix in chain([""], (f"-{n}" for n in count(2))))
        return next(path for path in map(self.folder.joinpath, names) if path not in self.own)

    def _bus(self, asked: dict[str, Any]) -> str:
        alone = not any(asked.get(name) not in (None, "ours") for name in ("flight", "emulator"))
        inline = alone and asked.get("pace") in (None, "lockstep")
        return self.bus if self.bus != "inline" or inline else "embedded"

    def discard(self) -> None:
        """Remove the run folders that are below `folder`."""
        for folder in self.own:
            shutil.rmtree(folder, ignore_errors=True)
