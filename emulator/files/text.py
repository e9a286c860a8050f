"""Text of a file from elsewhere: plain, packed, or in Hatanaka's compact form; of any encoding of the field.

Every reader of this folder takes its text from here and reports faults in one way: one line,
`FILE: line N: FIELD is FOUND; what is allowed`. What stands in a file is ASCII, but for letters in names and
comments, on which nothing depends: they are kept, one character each, so that columns stay.
Sources: Y. Hatanaka, A Compression Format and Tools for GNSS Observation Data, Bulletin of the Geographical
Survey Institute 55 (2008): compact RINEX 1.0 and 3.0
"""

from __future__ import annotations

import codecs
import re
import unicodedata
import warnings
from pathlib import Path

from gnss_hil.emulator.files.compression import PackedError, read_bytes

_COMPACT = b"CRINEX VERS   / TYPE"
_LONGEST_HEAD = 100
_NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f\x7f]")
"""Controls that no text has; 0x1a ended files once."""

_STRANGE = re.compile(r"[^\t\n\x1a\x20-\x7e]")
_BLANK = "Zs"
"""Unicode's category of blanks: that which no line breaks at, thin ones, ...; no separators of lines."""

_MARK = "\ufeff"
"""Of byte order; in the middle of a text where files with one were joined. Nothing is seen of it."""

_WIDE = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
"""Byte order marks of what PowerShell's > and Notepad's "Unicode" write."""

_WEB_PAGE = re.compile(r"\s*<(!doctype html|html)\b", re.I)


class FileError(ValueError):
    """A file that cannot be used; the message is one line, for people."""


def read_text(path: Path) -> str:
    """The text of a file, whatever it is packed in and compact RINEX undone; recognised by content, not by
    name. Lines end in "\\n"; see `decoded`.

    FileError if there is none.
    """
    try:
        raw = read_bytes(path)
    except PackedError as error:
        raise FileError(f"{path}: {error}") from None
    if _COMPACT in raw[:_LONGEST_HEAD]:
        raw = _expanded(raw, str(path))
    return decoded(raw, str(path))


def decoded(raw: bytes, origin: str) -> str:
    """Bytes as text that is not blank; `origin` names the file in errors.

    Byte order marks are passed over. Letters beyond ASCII stay, blanks beyond it become blanks, all else
    beyond it "?": no character but "\\n" of what is returned ends a line, and no digit is other than 0 to 9.
    """
    text = _unified_ends(_characters(raw, origin).replace(_MARK, ""))
    if not text.strip():
        raise FileError(f"{origin}: file is empty")
    strange = _NO_TEXT.search(text)
    if strange:
        line = text.count("\n", 0, strange.start()) + 1
        raise FileError(f"{origin}: line {line}: byte 0x{ord(strange[0]):02x} is not text")
    if _WEB_PAGE.match(text):
        raise FileError(f"{origin}: line 1: a web page, such as one to log in, not data")
    return _STRANGE.sub(_plain, text)


def _characters(raw: bytes, origin: str) -> str:
    """UTF-8, UTF-16 with its mark, or else Latin-1, in which every byte is a character."""
    for mark, encoding in _WIDE.items():
        if raw.startswith(mark):
            try:
                return raw.decode(encoding)
            except UnicodeDecodeError:
                raise FileError(f"{origin}: UTF-16 text is cut off or damaged") from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _unified_ends(text: str) -> str:
    """Lines that end in "\\n", whether they ended in LF, CR LF, CR, or CR CR LF; no end-of-file mark."""
    text = text.replace("\r\r\n", "\n").replace("\r\n", "\n").replace("\r", "\n")
    return re.sub(r"[\s\x1a]*\x1a[\s\x1a]*\Z", "\n", text)


def _plain(match: re.Match[str]) -> str:
    letter = match[0]
    if letter in "\v\f" or unicodedata.category(letter) == _BLANK:
        return " "
    return letter if letter.isalpha() else "?"


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
