"""Text of a file from elsewhere: plain, compressed, or in Hatanaka's compact form.

Every reader of this folder takes its text from here and reports faults in one way: one line,
`FILE: line N: FIELD is FOUND; what is allowed`.
Sources: RFC 1952 (gzip); Y. Hatanaka, A Compression Format and Tools for GNSS Observation Data, Bulletin of
the Geographical Survey Institute 55 (2008): compact RINEX 1.0 and 3.0
"""

from __future__ import annotations

import gzip
import re
import warnings
import zlib
from pathlib import Path

_GZIP = b"\x1f\x8b"
_COMPACT = b"CRINEX VERS   / TYPE"
_LONGEST_HEAD = 100
_NO_TEXT = re.compile(rb"[^\t\n\v\f\r\x1a\x20-\x7e]")
"""Neither ASCII nor white space; 0x1a ended files once."""


class FileError(ValueError):
    """A file that cannot be used; the message is one line, for people."""


def read_text(path: Path) -> str:
    """The ASCII text of a file, gzip or compact RINEX undone; recognised by content, not by name.

    FileError if there is none.
    """
    try:
        raw = path.read_bytes()
        if raw.startswith(_GZIP):
            raw = gzip.decompress(raw)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise FileError(f"{path}: gzip data is cut off or damaged") from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from None
    if _COMPACT in raw[:_LONGEST_HEAD]:
        raw = _expanded(raw, str(path))
    return decoded(raw, str(path))


def decoded(raw: bytes, origin: str) -> str:
    """Bytes as ASCII text that is not blank; `origin` names the file in errors."""
    if not raw.strip():
        raise FileError(f"{origin}: file is empty")
    strange = _NO_TEXT.search(raw)
    if strange:
        line = raw.count(b"\n", 0, strange.start()) + 1
        raise FileError(f"{origin}: line {line}: byte 0x{strange[0][0]:02x} is not text")
    return raw.decode("ascii")


def _expanded(raw: bytes, origin: str) -> bytes:
    """RINEX of compact RINEX. The tool's doubts are faults here: it would go on with epochs it lost."""
    # The package costs 50 ms, which only such a file should cost.
    import hatanaka

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return hatanaka.crx2rnx(raw)
    except (hatanaka.HatanakaException, UserWarning, OSError) as error:
        reason = " ".join(str(error).split()) or "no reason was given"
        raise FileError(f"{origin}: compact RINEX cannot be expanded: {reason}") from None
