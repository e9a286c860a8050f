"""Text out of files: compressed in several ways, damaged in more."""

from __future__ import annotations

import gzip

import hatanaka
import pytest

from gnss_hil.emulator.files.text import FileError, decoded, read_text
from tests.support.rinex_observations import GPS_2, KNOWN_3


@pytest.mark.parametrize("text", [GPS_2, KNOWN_3], ids=["compact RINEX 1", "compact RINEX 3"])
def test_compact_rinex_is_expanded(tmp_path, text):
    """Made by the reference implementation; known by content, inside gzip or not."""
    compact = hatanaka.rnx2crx(text.encode())
    assert b"COMPACT RINEX FORMAT" in compact
    for name, raw in (("plain", compact), ("gz", gzip.compress(compact))):
        path = tmp_path / name
        path.write_bytes(raw)
        assert [line.rstrip() for line in read_text(path).splitlines()] == [
            line.rstrip() for line in text.splitlines()
        ]


def test_every_cut_of_compact_rinex_is_read_or_refused_in_words(tmp_path):
    compact = hatanaka.rnx2crx(GPS_2.encode())
    path, refused = tmp_path / "cut.10d", 0
    for end in range(100, len(compact), 41):
        path.write_bytes(compact[:end])
        try:
            read_text(path)
        except FileError as error:
            refused += 1
            assert str(error).startswith(f"{path}: compact RINEX cannot be expanded: ")
            assert "\n" not in str(error)
    assert refused > 10


@pytest.mark.parametrize(
    "raw",
    [
        "aß\nb\n".encode(),
        "aß\nb\n".encode("latin-1"),
        "aß\nb\n".encode("utf-8-sig"),
        "aß\r\nb\r\n".encode("utf-16"),
        b"\xfe\xff" + "aß\nb\n".encode("utf-16-be"),
        "aß\rb\r".encode(),
        "aß\r\r\nb\r\r\n".encode(),
        "aß\nb\n\x1a".encode(),
        "aß\r\nb\r\n\x1a\r\n\x1a".encode("latin-1"),
        "\ufeffaß\n\ufeffb\n\ufeff".encode(),
    ],
)
def test_encodings_and_ends_of_lines_are_no_part_of_a_text(raw):
    assert decoded(raw, "x") == "aß\nb\n"


def test_a_character_is_a_column_and_none_but_ascii_counts_or_ends_a_line():
    """Arabic and raised digits, the next-line control of Latin-1, separators of lines, a minus sign."""
    text = "x\u00a0y\u202f\u0663\u00b2\u0085\u2028\u2029\u2212\v\fäΩ日z"
    found = decoded(text.encode(), "x")
    assert found == "x y ??????  äΩ日z"
    assert len(found) == len(text)
    assert len(found.splitlines()) == 1
    for letter in found:
        assert letter.isascii() or not (letter.isdigit() or letter.isspace())


def test_what_is_no_text_is_refused_with_its_line():
    for raw, words in (
        (b"a\nb\x00", "x: line 2: byte 0x00 is not text"),
        (b"\xff\xfea\x00b", "x: UTF-16 text is cut off or damaged"),
        (b"\xef\xbb\xbf \r\n", "x: file is empty"),
        (b"\n<!DOCTYPE html>\n<title>Log in", "x: line 1: a web page, such as one to log in, not data"),
    ):
        with pytest.raises(FileError) as caught:
            decoded(raw, "x")
        assert str(caught.value) == words
