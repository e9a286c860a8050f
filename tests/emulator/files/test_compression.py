"""Packed files: as other programs pack them, cut off, too large, or packed in ways that are not read."""

from __future__ import annotations

import bz2
import gzip
import lzma
import os
import tarfile
import zipfile
from io import BytesIO

import ncompress
import pytest

from gnss_hil.emulator.files import compression
from gnss_hil.emulator.files.compression import PackedError, unpacked
from gnss_hil.emulator.files.text import FileError, read_text

pytestmark = pytest.mark.verifies(
    "emulator/files/compression.py",
    what="Packed files",
    by="gzip, bzip2, xz and zip of Python's library, compress of ncompress",
    status="validated",
)

TEXT = b"".join(b"line %d of what a file holds\n" % n for n in range(2000))


def zipped(*members, **how):
    out = BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, **how) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return out.getvalue()


PACKED = {
    "gz": gzip.compress(TEXT),
    "gz of two": gzip.compress(TEXT[:999]) + gzip.compress(TEXT[999:]),
    "Z": ncompress.compress(TEXT),
    "bz2": bz2.compress(TEXT),
    "bz2 of two": bz2.compress(TEXT[:999]) + bz2.compress(TEXT[999:]),
    "xz": lzma.compress(TEXT),
    "xz of two, padded": lzma.compress(TEXT[:999]) + lzma.compress(TEXT[999:]) + bytes(4),
    "zip": zipped(("a.sp3", TEXT)),
    "zip of a Mac, in a folder": zipped(("a/", b""), ("a/a.sp3", TEXT), ("__MACOSX/a/._a.sp3", b"x")),
    "zip of a Mac's disk": zipped(("a.sp3", TEXT), (".DS_Store", b"x"), ("a/Thumbs.db", b"x")),
    "gz in a zip": zipped(("a.sp3.gz", gzip.compress(TEXT))),
    "Z in a gz": gzip.compress(ncompress.compress(TEXT)),
    "plain": TEXT,
}


@pytest.mark.parametrize("packed", PACKED.values(), ids=PACKED)
def test_what_is_packed_is_unpacked_whatever_its_name(tmp_path, packed):
    path = tmp_path / "file.dat"
    path.write_bytes(packed)
    assert read_text(path) == TEXT.decode()


@pytest.mark.parametrize("kind", ["gz", "bz2", "xz", "zip"])
def test_packed_data_that_is_cut_or_damaged_is_refused(kind):
    whole = PACKED[kind]
    middle = len(whole) // 2
    for bad in (whole[:-30], whole[:middle], whole[:middle] + bytes(20) + whole[middle + 20 :]):
        with pytest.raises(PackedError, match=r"data is cut off or damaged"):
            unpacked(bad)


@pytest.mark.parametrize("kind", ["gz", "bz2", "xz"])
def test_a_second_stream_that_is_none_is_not_left_out(kind):
    for behind in (b"no stream", PACKED[kind][:20], b"\0" + PACKED[kind][1:]):
        with pytest.raises(PackedError, match=r"data is cut off or damaged"):
            unpacked(PACKED[kind] + behind)


def test_compress_cut_anywhere_but_at_the_end_of_a_line_is_refused():
    """The format has neither length nor sum: what is left are bits of a code cut in two, and lines."""
    whole, read = PACKED["Z"], []
    for end in range(3, len(whole)):
        try:
            read.append(unpacked(whole[:end]))
        except PackedError as error:
            assert "is cut off" in str(error)
    assert all(TEXT.startswith(text) and text[-1:] in (b"", b"\n") for text in read)
    assert len(read) < 0.03 * len(whole)


def tarred():
    out = BytesIO()
    with tarfile.open(fileobj=out, mode="w") as archive:
        member = tarfile.TarInfo("a.sp3")
        member.size = len(TEXT)
        archive.addfile(member, BytesIO(TEXT))
    return out.getvalue()


def test_damage_in_compress_is_refused():
    with pytest.raises(PackedError, match=r"compress \(.Z\) data is cut off or damaged"):
        unpacked(b"\x1f\x9d\x90" + b"\xff" * 50)


@pytest.mark.parametrize("kind", ["gz", "Z", "bz2", "xz", "zip"])
def test_nothing_grows_beyond_the_largest(monkeypatch, kind):
    assert compression.LARGEST == 512 << 20
    monkeypatch.setattr(compression, "LARGEST", len(TEXT))
    assert unpacked(PACKED[kind]) == TEXT
    monkeypatch.setattr(compression, "LARGEST", len(TEXT) - 1)
    with pytest.raises(PackedError, match="unpacked it has more than 0 MB"):
        unpacked(PACKED[kind])


def test_a_plain_file_beyond_the_largest_is_not_read(tmp_path):
    path = tmp_path / "holes"
    with path.open("wb") as stream:
        stream.truncate(compression.LARGEST + 1)
    with pytest.raises(FileError, match=r"holes: file has 512 MB; up to 512 are read"):
        read_text(path)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (zipped(("a", b"x"), ("b", b"y")), "zip holds 2 files; one is read"),
        (zipped(), "zip holds 0 files; one is read"),
        (b"\x28\xb5\x2f\xfd....", "zstd is not read; unpack it, or pack it as .gz"),
        (b"7z\xbc\xaf\x27\x1c....", "7z is not read"),
        (b"Rar!....", "rar is not read"),
        (lzma.compress(TEXT, lzma.FORMAT_ALONE), "lzma is not read"),
        (tarred(), "tar archive is not read; unpack the file of it"),
        (gzip.compress(tarred()), "tar archive is not read; unpack the file of it"),
        (gzip.compress(gzip.compress(gzip.compress(TEXT))), "is packed more than 2 times"),
    ],
)
def test_what_is_not_read_is_named(raw, words):
    with pytest.raises(PackedError, match=words):
        unpacked(raw)


def test_an_encrypted_zip_is_named():
    raw = bytearray(PACKED["zip"])
    raw[6] |= 1  # general purpose flag of the local header, and of the central one
    raw[raw.index(b"PK\1\2") + 8] |= 1
    with pytest.raises(PackedError, match="zip is encrypted"):
        unpacked(bytes(raw))


def test_only_regular_files_are_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match=r"pipe: not a regular file"):
        read_text(tmp_path / "pipe")


def test_a_zip_of_an_unknown_method_is_named():
    raw = bytearray(zipped(("a.sp3", TEXT)))
    for place in (raw.index(b"PK\x03\x04") + 8, raw.index(b"PK\x01\x02") + 10):
        raw[place : place + 2] = (97).to_bytes(2, "little")
    with pytest.raises(PackedError, match="zip is packed in a way that is not read"):
        unpacked(bytes(raw))
