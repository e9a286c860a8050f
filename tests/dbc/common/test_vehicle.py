"""The vehicle file at the door."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from gnss_hil.dbc.common import shipped_files
from gnss_hil.dbc.common.vehicle import FILES, VehicleError, find, load, parse, with_unit_vectors

pytestmark = pytest.mark.verifies(
    "dbc/common/vehicle.py",
    "dbc/common/shipped_files.py",
    "dbc/common/registry.py",
    "dbc/common/strict.py",
    what="Vehicle file, registries",
    by="antenna places are typical, not published; boresights, mask and channels are the patent's",
    status="modelled",
)

SOYUZ = find("soyuz-ms")
TEXT = SOYUZ.read_text("utf-8")


def test_soyuz_tilts_35_deg_from_zenith_to_four_sides():
    vehicle = load(SOYUZ)
    zenith = np.array([0.0, 0.0, -1.0])
    tilt = np.arctan2(
        np.linalg.norm(np.cross(vehicle.boresight_body, zenith), axis=1), vehicle.boresight_body @ zenith
    )
    assert np.rad2deg(tilt) == pytest.approx(35)
    assert vehicle.names == ("fore", "starboard", "aft", "port")
    assert vehicle.boresight_body[0, 0] > 0 and vehicle.boresight_body[1, 1] > 0
    assert vehicle.channels.sum() == 24
    assert np.rad2deg(vehicle.mask_rad) == pytest.approx(85)
    assert set(vehicle.clock_domain) == {0}


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("receiver = 2", "receiver = 1", r"antenna receivers are \[1, 1, 3, 4\]; each of 1 to 4 once"),
        ('"starboard"', '"fore"', "antenna names are .* each must be different"),
        (
            "boresight_body = [0.573576436351046, 0.0, -0.819152044288992]",
            "boresight_body = [0, 0.0, -1e-9]",
            "antenna.0: boresight_body has length 1e-09; it points nowhere",
        ),
        (
            "mask_deg = 85.0",
            "mask_deg = 185.0",
            "antenna.0.mask_deg: input should be less than or equal to 180",
        ),
        ("channels = 6", "chanels = 6", "antenna.0.chanels: unknown key"),
        ("channels = 6", "", "antenna.0.channels: missing"),
        ("channels = 6", 'channels = "six"', "antenna.0.channels: .*found 'six'"),
        ("channels = 6", 'channels = "6"', "antenna.0.channels: .*valid integer, found '6'"),
        ("channels = 6", "channels = true", "antenna.0.channels: .*valid integer, found True"),
        ("mask_deg = 85.0", 'mask_deg = "85"', "antenna.0.mask_deg: .*valid number, found '85'"),
        ("mask_deg = 85.0", "mask_deg = true", "antenna.0.mask_deg: .*valid number, found True"),
        ("mask_deg = 85.0", "mask_deg = nan", "antenna.0.mask_deg: input should be a finite number"),
        ("[[antenna]]", "[[antenna", "not TOML"),
    ],
)
def test_mistakes_get_a_line(old, new, line):
    with pytest.raises(VehicleError, match=line):
        parse(TEXT.replace(old, new, 1), "mine.toml")


def test_whole_numbers_serve_as_any():
    assert parse(TEXT.replace("mask_deg = 85.0", "mask_deg = 85"), "mine.toml").mask_rad.tolist() == (
        load(SOYUZ).mask_rad.tolist()
    )


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(VehicleError, match=r"none.toml: No such file or directory"):
        load(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(VehicleError, match="not UTF-8 text"):
        load(tmp_path / "binary.toml")


def test_shipped_vehicles_are_found_by_name(tmp_path):
    assert find("soyuz-ms") == find("soyuz-ms.toml")
    (tmp_path / "soyuz-ms.toml").write_text(TEXT)
    assert find("soyuz-ms.toml", tmp_path) == tmp_path / "soyuz-ms.toml"
    with pytest.raises(VehicleError, match=r"vehicle 'mir': no such file; shipped are .*soyuz-ms-4clocks"):
        find("mir", tmp_path)


def test_directions_have_length_one():
    """Of a file whose directions are rounded to four digits, as people write them."""
    vehicle = parse(
        TEXT.replace("0.573576436351046", "0.5736").replace("0.819152044288992", "0.8192"), "a file"
    )
    assert np.linalg.norm(vehicle.boresight_body, axis=1) == pytest.approx(1, abs=1e-12)


AXIS = "boresight_body = [0.573576436351046, 0.0, -0.819152044288992]"


@pytest.mark.parametrize(
    ("written", "axis"),
    [
        ("boresight_body = [0.0, 0.0, -12.5]", (0, 0, -1)),
        ("boresight_body = [3, 4, 0]", (0.6, 0.8, 0)),
        ("boresight_azimuth_deg = 0\nboresight_elevation_deg = 0", (1, 0, 0)),
        ("boresight_azimuth_deg = 90\nboresight_elevation_deg = 0", (0, 1, 0)),
        ("boresight_azimuth_deg = -90\nboresight_elevation_deg = 30", (0, -(3**0.5) / 2, -0.5)),
        ("boresight_azimuth_deg = 123\nboresight_elevation_deg = 90", (0, 0, -1)),
        ("boresight_azimuth_deg = 0\nboresight_elevation_deg = 55.0", (0.573576436351, 0, -0.819152044289)),
    ],
)  # fmt: skip
def test_a_boresight_has_any_length_or_is_azimuth_and_elevation(written, axis):
    """Azimuth from fore towards starboard, elevation towards zenith (-z)."""
    assert parse(TEXT.replace(AXIS, written), "a file").boresight_body[0] == pytest.approx(axis, abs=1e-11)


@pytest.mark.parametrize(
    "written",
    ["", "boresight_azimuth_deg = 3", f"{AXIS}\nboresight_elevation_deg = 3",
     f"{AXIS}\nboresight_elevation_deg = 3\nboresight_azimuth_deg = 3"],
)  # fmt: skip
def test_a_boresight_is_given_in_one_way(written):
    with pytest.raises(VehicleError, match=r"antenna\.0: .*one of the two$"):
        parse(TEXT.replace(AXIS, written), "a file")


def test_programs_of_others_find_unit_vectors():
    """What a run folder holds, and GNSS_HIL_VEHICLE names: examples/fsw_c knows nothing else."""
    assert with_unit_vectors(TEXT, "a file") is None
    angles = "boresight_azimuth_deg = 0\nboresight_elevation_deg = 55"
    for written in (angles, "boresight_body = [5.73576436351046, 0, -8.19152044288992]"):
        text = TEXT.replace(AXIS, written)
        plain = tomli_w.dumps(with_unit_vectors(text, "a file"))
        assert "azimuth" not in plain
        meant, found = parse(text, "a file").boresight_body, parse(plain, "plain").boresight_body
        assert found == pytest.approx(meant, abs=1e-15)
        assert with_unit_vectors(plain, "plain") is None


def test_rows_are_receivers_whatever_the_order_in_the_file():
    head, *antennas = TEXT.split("[[antenna]]")
    turned = parse("[[antenna]]".join([head, *(f"{part}\n" for part in reversed(antennas))]), "a file")
    written = load(SOYUZ)
    assert turned.names == written.names
    assert turned.lever_arm_body_m.tolist() == written.lever_arm_body_m.tolist()


def test_a_byte_order_mark_and_ends_of_lines_are_no_part_of_a_file(tmp_path):
    plain = TEXT
    for number, raw in enumerate(
        (plain.encode("utf-8-sig"), plain.replace("\n", "\r\n").encode("utf-8-sig"))
    ):
        path = tmp_path / f"{number}.toml"
        path.write_bytes(raw)
        assert load(path).names == load(SOYUZ).names
        assert FILES.text(path) == plain


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ("name = 'x'".encode("utf-16"), "not UTF-8 text but UTF-16, as PowerShell's > writes"),
        (b"\xfe\xff\x00a", "but UTF-16"),
        (b"# a\n# \xe4\n", r"not UTF-8 text \(byte 0xe4 in line 2\)"),
    ],
)
def test_other_encodings_are_named(tmp_path, raw, words):
    path = tmp_path / "x.toml"
    path.write_bytes(raw)
    with pytest.raises(VehicleError, match=words):
        load(path)


@pytest.mark.parametrize(
    "odd",
    [
        pytest.param("a = " + 3000 * "[" + 3000 * "]", id="lists"),
        pytest.param("a" + 3000 * ".a" + " = 1", id="tables"),
        pytest.param("a = " + 40 * "[{a = " + "1" + 40 * "}]", id="both"),
    ],
)
def test_what_lies_deep_is_told_in_a_line(odd):
    with pytest.raises(VehicleError, match=r"x\.toml: tables or lists lie more than 32 deep in each other"):
        FILES.document(odd, "x.toml")


def test_a_name_that_is_no_file_with_an_end_is_told(tmp_path, monkeypatch):
    pipe, large = tmp_path / "pipe.toml", tmp_path / "large.toml"
    os.mkfifo(pipe)
    large.write_text(TEXT)
    monkeypatch.setattr(shipped_files, "LARGEST", 100)
    for path, said in (
        (pipe, "not a regular file"),
        (Path("/dev/zero"), "not a regular file"),
        (tmp_path, "is a folder"),
        (large, "file has 0 MB"),
        (tmp_path / "none.toml", "No such file or directory"),
    ):
        with pytest.raises(VehicleError, match=f"{path}: {said}"):
            FILES.read(path)
