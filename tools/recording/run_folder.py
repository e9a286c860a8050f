"""The run folder: what is in it, how it comes to be, how it is taken back when nothing came of it."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common.vehicle import with_unit_vectors
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.common import toml
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.common.places import check_new_folder
from gnss_hil.tools.common.whole_file import draft_of
from gnss_hil.tools.recording.provenance import take_inputs

LOG, TRUTH, SUMMARY, SCENARIO, FACTS = "bus.log", "truth", "summary.json", "scenario.toml", "run.json"
FAULTS = "faults"
"""What faults did, as it happened; where there are faults."""
SCHEMA_LINE = re.compile(r"^#:schema .*\n", re.M)


def vehicle_name(craft: Sequence[str], i: int) -> str:
    """Name of a craft's vehicle file in a run folder."""
    return "vehicle.toml" if len(craft) == 1 else f"vehicle-{craft[i]}.toml"


def default_path(scenario: str) -> Path:
    """runs/<scenario>-<now>, with a number behind it if that is taken."""
    stem = f"{scenario}-{datetime.now():%Y%m%d-%H%M%S}"
    candidates = (Path("runs") / (stem + suffix) for suffix in ("", *(f"-{i}" for i in range(2, 1000))))
    return next(path for path in candidates if not path.exists())


def check_run_folder(path: Path, needs: Sequence[str] = (SCENARIO,)) -> None:
    """Mistake if there is no run folder at `path`, or it lacks one of the files that are needed."""
    if not path.is_dir():
        wrong = "is a file; name the run folder" if path.exists() else "no such run folder"
        raise Mistake(f"{path}: {wrong}")
    for name in needs:
        if not (path / name).is_file():
            raise Mistake(f"{path}: is no run folder: it has no {name}")


class RunFolder:
    """A new folder; `discard` removes it and the folders above that were made for it.

    option  that named it
    """

    def __init__(self, path: Path, option: str = "--out"):
        self.path = path
        check_new_folder(path, option)
        self._made = [p for p in (path, *path.parents) if not p.exists()]
        try:
            path.mkdir(parents=True, exist_ok=True)
            probe = path / ".writable"
            probe.touch()
            probe.unlink()
        except OSError as error:
            self.discard()
            raise Mistake(f"{option} {path}: cannot be written: {error.strerror}") from None

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def describe(self, scenario: Scenario, vehicle_texts: Sequence[str]) -> list[dict[str, Any]]:
        """scenario.toml, the vehicle file of each craft and the files that the scenario names: enough to play
        the run again. What was taken in, as `provenance.take_inputs` has it."""
        names = [craft.name for craft in scenario.craft]
        for i, text in enumerate(vehicle_texts):
            plain = with_unit_vectors(text, names[i])
            # Its schema line names a file beside the original.
            own = SCHEMA_LINE.sub("", text) if plain is None else toml.dumps(plain)
            (self / vehicle_name(names, i)).write_text(own, "utf-8")
        document = scenario.model_dump(mode="json", exclude_none=True)
        del document["fault"]
        if scenario.fault:  # as they were given: most keys of a place are empty
            document["fault"] = [one.model_dump(mode="json", exclude_unset=True) for one in scenario.fault]
        taken = take_inputs(document, self.path)
        (self / SCENARIO).write_text(toml.dumps(document), "utf-8")
        return taken

    def discard(self) -> None:
        for path in self._made:
            if path == self.path:
                shutil.rmtree(path, ignore_errors=True)
            else:
                _remove_if_empty(path)


def _remove_if_empty(path: Path) -> None:
    try:
        path.rmdir()
    except OSError:
        return  # another program has put something there


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """An OSError that does not say where it arose (a write does not) arose in `path`."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """A JSON file that is there whole or not at all."""
    with draft_of(path) as draft:
        draft.write_text(json.dumps(document, indent=2) + "\n", "utf-8")
