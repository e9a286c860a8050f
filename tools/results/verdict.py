"""What --junit asks for: written whatever becomes of a run, with the time that it took."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from gnss_hil.tools.recording import provenance
from gnss_hil.tools.results import junit


class Verdict:
    """The verdict of a run that begins now."""

    def __init__(self, path: Path, name: str, command: str):
        self._path, self._name = path, name
        self._begun_s, self._begun_utc = time.monotonic(), provenance.now()
        self._host = provenance.host()["name"]
        program = {key: value for key, value in provenance.program().items() if value}
        self._properties = {**program, "command": command}
        self._written = False
        self._suites: list[ElementTree.Element] = []

    def suite(self, summary: Mapping[str, Any], folder: Path, failures: Sequence[str]) -> None:
        """One of several runs, since the last; `write_suites` writes them."""
        run = self._run(f"{summary['scenario']}, seed {summary['seed']}", {"run folder": str(folder)})
        self._suites.append(junit.suite(run, summary, failures))
        self._begun_s, self._begun_utc = time.monotonic(), provenance.now()

    def error_suite(self, seed: int, text: str) -> None:
        """One of several runs that never came to a summary."""
        self._suites.append(junit.error_suite(self._run(f"{self._name}, seed {seed}", {}), text))

    def write_suites(self) -> list[str]:
        """The runs there were; a line if they cannot be written."""
        self._written = True
        try:
            junit.write_all(self._path, self._suites)
        except OSError as error:
            return [f"--junit {self._path}: {error.strerror}"]
        return []

    def write(self, summary: Mapping[str, Any], folder: Path, failures: Sequence[str]) -> list[str]:
        """Of a run with a summary; a line if it cannot be written."""
        self._written = True
        run = self._run(summary["scenario"], {"run folder": str(folder)})
        try:
            junit.write(self._path, run, summary, failures)
        except OSError as error:
            return [f"--junit {self._path}: {error.strerror}"]
        return []

    def write_error(self, text: str) -> None:
        """Of a run without. What went wrong with it is worth more than what does with the file."""
        if not self._written:
            with suppress(OSError):
                junit.write_error(self._path, self._run(self._name, {}), text)

    def _run(self, name: str, more: Mapping[str, str]) -> junit.Run:
        wall_s = time.monotonic() - self._begun_s
        return junit.Run(name, self._begun_utc, wall_s, self._host, {**self._properties, **more})
