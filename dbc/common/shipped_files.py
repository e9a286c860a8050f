"""Kinds of TOML files that ship with the bench or are given by path: vehicles, structures, scenarios.

What is wrong with a file is reported in one line a fault, as the kind's own exception.
"""

from __future__ import annotations

import codecs
import stat
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import BaseModel, ValidationError

from gnss_hil.dbc.common.faults import faults
from gnss_hil.dbc.common.near import hint

Model = TypeVar("Model", bound=BaseModel)

_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)

LARGEST = 16 << 20
"""Bytes of a file; those that ship have some thousand."""

DEEPEST = 32
"""Tables and lists in each other; what is described here goes six deep."""


@dataclass(frozen=True, slots=True)
class Files(Generic[Model]):
    """A kind of files.

    noun              of one of them
    package, folder   where those are that ship
    model             what their contents are
    mistake           raised, with a message for people
    """

    noun: str
    package: str
    folder: str
    model: type[Model]
    mistake: type[ValueError]

    def read(self, path: Path) -> dict:
        """The TOML document of a file."""
        return self.document(self.text(path), str(path))

    def text(self, path: Path) -> str:
        """The text of a file, without a byte order mark."""
        try:
            status = Path(path).stat()
            if not stat.S_ISREG(status.st_mode):
                what = "is a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
                raise self.mistake(f"{path}: {what}")
            if status.st_size > LARGEST:
                raise self.mistake(
                    f"{path}: file has {status.st_size >> 20} MB; up to {LARGEST >> 20} are read"
                )
            raw = Path(path).read_bytes()
        except OSError as error:
            raise self.mistake(f"{path}: {error.strerror}") from None
        if raw.startswith(_UTF_16):
            raise self.mistake(f"{path}: not UTF-8 text but UTF-16, as PowerShell's > writes")
        try:
            # As Path.read_text has it: lines end in LF, CR LF or CR.
            return raw.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        except UnicodeDecodeError as error:
            line = raw.count(b"\n", 0, error.start) + 1
            found = f"byte 0x{raw[error.start]:02x} in line {line}"
            raise self.mistake(f"{path}: not UTF-8 text ({found})") from None

    def document(self, text: str, origin: str) -> dict:
        """The TOML document of a text."""
        try:
            document = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise self.mistake(f"{origin}: not TOML: {error}") from None
        except RecursionError:
            document = None
        if document is None or _is_deep(document):
            raise self.mistake(f"{origin}: tables or lists lie more than {DEEPEST} deep in each other")
        return document

    def checked(self, document: dict, origin: str) -> Model:
        """What a document says."""
        try:
            return self.model.model_validate(document)
        except ValidationError as error:
            raise self.mistake("\n".join(faults(error, origin, self.model))) from None

    def shipped(self) -> dict[str, Path]:
        """Those that come with the bench, by name."""
        folder = Path(str(resources.files(self.package))) / self.folder
        return {file.stem: file for file in sorted(folder.glob("*.toml"))}

    def find(self, name: str, folder: Path = Path()) -> Path:
        """One by path (relative to a folder) or shipped name, with or without .toml."""
        beside = folder / name
        if beside.is_file():
            return beside
        known = self.shipped()
        stem = name.removesuffix(".toml")
        if stem not in known:
            listed = f"shipped are {', '.join(known)}{hint(stem, known)}"
            found = "is a folder" if beside.is_dir() else "no such file"
            raise self.mistake(f"{self.noun} '{name}': {found}; {listed}")
        return known[stem]


def _is_deep(document: dict) -> bool:
    """Whether something lies too deep in a document; level by level, so that no depth is too much."""
    level: list = [document]
    for _ in range(DEEPEST):
        inner = (item.values() if isinstance(item, dict) else item for item in level)
        level = [item for items in inner for item in items if isinstance(item, dict | list)]
    return bool(level)
