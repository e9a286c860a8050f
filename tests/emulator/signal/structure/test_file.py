"""Structure files: what ships is whole, and a fault gets one line."""

import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator.signal.structure import file
from gnss_hil.emulator.signal.structure.bodies import require_outside, structure

BOX = '[[box]]\nname = "hull"\ncentre_m = [0.0, 0.0, 0.0]\nsize_m = [2.0, 2.0, 2.0]\n'
PANEL = (
    '[[panel]]\nname = "wing"\ncentre_m = [0.0, 3.0, 0.0]\nnormal_body = [0.0, 0.0, -1.0]\n'
    "along_body = [0.0, 1.0, 0.0]\nsize_m = [4.0, 1.0]\n"
)
JOINT = '[[joint]]\nname = "alpha"\npoint_m = [0.0, 0.0, 0.0]\naxis_body = [0.0, 1.0, 0.0]\n'
SUN = 'turns = "sun"\nfacing_body = [0.0, 0.0, -1.0]\n'


@pytest.mark.parametrize(("name", "vehicles"), [("iss", ("iss-asn-m",)), ("soyuz-ms", ("soyuz-ms",))])
def test_antennas_of_shipped_craft_are_outside_their_hulls(name, vehicles):
    craft = structure(file.load(file.find(name)))
    for antennas in (vehicle.load(vehicle.find(v)) for v in vehicles):
        require_outside(craft, dict(zip(antennas.names, antennas.lever_arm_body_m, strict=True)))


def test_an_antenna_inside_a_hull_is_refused_by_name():
    craft = structure(file.parse(f'name = "x"\n{BOX}', "x.toml"))
    with pytest.raises(file.StructureError, match="antenna 'a' is inside 'hull'"):
        require_outside(craft, {"a": (0.9, 0.0, 0.0)})


@pytest.mark.verifies(
    "emulator/signal/structure/file.py",
    "emulator/signal/structure/bodies.py",
    what="Structure files: boxes, panels, joints",
    by=(
        "published spans of the ISS (108.5 m, 73.2 m, 29.7 m) and of Soyuz MS; Gauss's theorem on every "
        "body. Places along the axes, Zvezda's compartments and the antennas' places are typical"
    ),
    status="validated",
)
def test_dimensions_that_are_published():
    """108.5 m over the ISS's arrays (NASA), 73.2 m over a pair of wings (Boeing: 240 ft), 29.7 m over
    those of Zvezda, which is 13.1 m long, 10.7 m over those of Soyuz MS."""
    parts = {part.name: part for part in file.load(file.find("iss")).parts}
    wing = parts["wing starboard 48.5 fore"]
    assert 2 * (wing.centre_m[1] + wing.size_m[1] / 2) == pytest.approx(108.5, abs=0.2)
    aft = parts["wing starboard 48.5 aft"]
    pair = wing.centre_m[0] - aft.centre_m[0] + wing.size_m[0]
    assert pair == pytest.approx(73.2, abs=0.1)
    array = parts["zvezda array starboard"]
    assert 2 * (array.centre_m[1] + array.size_m[0] / 2) == pytest.approx(29.7, abs=0.05)
    zvezda = [part for name, part in parts.items() if name.startswith("zvezda ") and "array" not in name]
    assert sum(part.size_m[0] for part in zvezda) == pytest.approx(13.1)
    soyuz = {part.name: part for part in file.load(file.find("soyuz-ms")).parts}["array starboard"]
    assert 2 * (soyuz.centre_m[1] + soyuz.size_m[0] / 2) == pytest.approx(10.7, abs=0.02)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = ", "x.toml: not TOML"),
        ('name = "x"\n', "x.toml: file: no box and no panel"),
        (f'name = "x"\n{BOX}colour = "red"\n', "x.toml: box.0.colour: unknown key"),
        (f'name = "x"\n{BOX.replace("2.0, 2.0]", "2.0, -2.0]")}', "x.toml: box.0.size_m.2"),
        (f'name = "x"\n{BOX}{BOX}', "two parts are named 'hull'"),
        (f'name = "x"\n{BOX}material = "cheese"\n', "x.toml: box.0.material"),
        (f'name = "x"\n{BOX}joint = "beta"\n', "'hull': there is no joint 'beta'"),
        (f'name = "x"\n{PANEL.replace("-1.0]", "-2.0]")}', "normal_body has length 2"),
        (f'name = "x"\n{PANEL.replace("along_body = [0.0, 1.0, 0.0]", "along_body = [0.0, 0.0, 1.0]")}',
         "along_body is not at right angles to normal_body"),
        (f'name = "x"\n{BOX}{JOINT}turns = "sun"\n', "facing_body goes with turns = 'sun'"),
        (f'name = "x"\n{BOX}{JOINT}{SUN.replace("0.0, 0.0, -1.0", "0.0, 1.0, 0.0")}',
         "facing_body is not at right angles to axis_body"),
        (f'name = "x"\n{BOX}{JOINT}{SUN}rate_dps = 1.0\n', "rate_dps goes with turns = 'rate'"),
        (f'name = "x"\n{BOX}{JOINT}{SUN}parent = "alpha"\n',
         "parent 'alpha' is not among the joints before it"),
    ],
)  # fmt: skip
def test_a_fault_gets_one_line_with_file_and_key(text, says):
    with pytest.raises(file.StructureError) as caught:
        file.parse(text, "x.toml")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(file.StructureError, match="shipped are iss, soyuz-ms"):
        file.find("mir", tmp_path)
    with pytest.raises(file.StructureError, match="No such file"):
        file.load(tmp_path / "none.toml")
    (tmp_path / "mine.toml").write_bytes(b"\xff")
    with pytest.raises(file.StructureError, match="not UTF-8"):
        file.load(file.find("mine.toml", tmp_path))
