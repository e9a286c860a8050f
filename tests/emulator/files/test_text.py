"""Text out of files: compressed in several ways, damaged in more."""

from __future__ import annotations

import gzip

import hatanaka
import pytest

from gnss_hil.emulator.files.text import FileError, read_text
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
