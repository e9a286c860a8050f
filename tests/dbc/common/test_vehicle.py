"""The vehicle file at the door."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.vehicle import FILES, VehicleError, find, load, parse

pytestmark = pytest.mark.verifies(
    "dbc/common/vehicle.py",
    "dbc/common/shipped_files.py",
    "dbc/common/registry.py",
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
            "-0.819152044288992]",
            "-0.5]",
            "antenna.0: boresight_body has length 0.7609; a direction has length 1",
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
