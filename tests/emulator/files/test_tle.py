"""Two-line element sets: whose, of which epoch."""

from __future__ import annotations

from datetime import datetime

import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.files import tle
from gnss_hil.emulator.files.text import FileError

pytestmark = pytest.mark.verifies(
    "emulator/files/tle.py",
    what="Which of several element sets is meant",
    by="made-up sets",
    status="modelled",
)


def whole(line):
    """A line with its checksum."""
    return f"{line}{sum(int(c) if c.isdigit() else c == '-' for c in line) % 10}"


def lines(epoch, number="99001"):
    first = f"1 {number}U 12001A   {epoch}  .00002000  00000-0  40000-4 0  999"
    second = f"2 {number}  51.6000 100.0000 0005000  90.0000  10.0000 15.50000000  100"
    return f"{whole(first)}\n{whole(second)}\n"


def gps(*calendar):
    return gpstime.from_utc(datetime(*calendar))


@pytest.mark.parametrize(
    ("epoch", "moment"),
    [
        ("12305.50000000", gps(2012, 10, 31, 12)),
        ("12  5.50000000", None),
        ("57001.00000000", gps(1957, 1, 1)),
        ("56366.25000000", gps(2056, 12, 31, 6)),
        ("12367.00000000", None),
        ("123x5.50000000", None),
    ],
)
def test_the_epoch_is_that_of_columns_19_to_32(epoch, moment):
    text = lines(epoch)
    if moment is None and "x" not in epoch and epoch[2:5].strip() == "5":
        assert tle.parse(text, "x")[0].epoch_ns == gps(2012, 1, 5, 12)
    elif moment is None:
        with pytest.raises(FileError, match=r"x: line 1: epoch is '.*'; allowed is such as 12305\.5"):
            tle.parse(text, "x")
    else:
        assert tle.parse(text, "x")[0].epoch_ns == moment


HISTORY = [lines(f"12{day:03d}.50000000") for day in (200, 305, 250, 100)]


@pytest.mark.parametrize("asked", [None, "CRAFT", "craft", "99001"])
def test_of_a_history_the_set_nearest_to_the_run_is_meant(asked):
    sets = tle.parse("".join(f"CRAFT\n{one}" for one in HISTORY), "x")
    for day, of_day in ((1, 100), (240, 250), (305, 305), (366, 305)):
        near_ns = gpstime.from_utc(datetime(2012, 1, 1)) + (day - 1) * gpstime.NS_PER_DAY
        assert tle.choose(sets, asked, "x", near_ns).line1[20:23] == f"{of_day}"


def test_several_objects_are_not_guessed_from():
    sets = tle.parse(f"A\n{lines('12305.5       ')}B\n{lines('12305.5       ', '99002')}", "x")
    assert tle.choose(sets, "b", "x", 0).line1[2:7] == "99002"
    with pytest.raises(FileError, match="x: object is missing; the file has A, B"):
        tle.choose(sets, None, "x", 0)
    with pytest.raises(FileError, match="x: object is 'C'; the file has A, B"):
        tle.choose(sets, "C", "x", 0)
    same = tle.parse(f"A\n{lines('12305.5       ')}A\n{lines('12305.5       ', '99002')}", "x")
    with pytest.raises(
        FileError, match="object is 'A'; the file has several of that name, of numbers 99001, 99"
    ):
        tle.choose(same, "A", "x", 0)


def test_blank_lines_indents_and_comments_are_no_part_of_a_set():
    first, second = lines("12305.50000000").splitlines()
    text = f"# from somewhere\n\n  CRAFT  \n  {first}  \n\n# between\n\t{second}\n\n"
    assert tle.parse(text, "x") == tle.parse(f"CRAFT\n{first}\n{second}\n", "x")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("00000-0", "00000-x", "line 1: second rate is ' 00000-x', not a number of its form"),
        ("40000-4", "4x000-4", "line 1: drag term is ' 4x000-4'"),
        (".00002000", ".0000x000", "line 1: rate of mean motion is ' .0000x000'"),
        ("51.6000", "51.x000", "line 2: inclination is ' 51.x000'"),
        ("0005000", "0005.00", "line 2: eccentricity is '0005.00'"),
        ("15.50000000", "15.5 000000", "line 2: mean motion is '15.5 000000'"),
    ],
)
def test_numbers_are_of_their_form(old, new, words):
    text = "".join(whole(line[:-1].replace(old, new)) + "\n" for line in lines("12305.50000000").splitlines())
    with pytest.raises(FileError) as caught:
        tle.parse(text, "x")
    assert words in str(caught.value)


RATE, DRAG, SECOND = "  .00002000", " 40000-4", " 00000-0"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (RATE, " -.00002000"), (RATE, " " * 11), (DRAG, "-40000-4"), (SECOND, " 00000+0"), (SECOND, " " * 8),
        (" 51.6000", "  1.6000"),
    ],
)  # fmt: skip
def test_signs_blanks_and_missing_rates_are_read(old, new):
    changed = [whole(line[:-1].replace(old, new)) for line in lines("12305.50000000").splitlines()]
    assert len(tle.parse("\n".join(changed), "x")) == 1


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (" 51.6000", "999.9999", "inclination is '999.9999'; allowed is 0 to 180"),
        (" 51.6000", "        ", "inclination is ''; allowed is 0 to 180"),
        ("100.0000", "999.9999", "right ascension is '999.9999'; allowed is 0 to 360"),
        ("100.0000", "-10.0000", "right ascension is '-10.0000'"),
        ("15.50000000", " 0.00000000", "mean motion is '0.00000000'; allowed is 0.001 to 20"),
        ("15.50000000", "99.99999999", "mean motion is '99.99999999'"),
    ],
)
def test_numbers_that_no_orbit_has_stand_for_none(old, new, words):
    first, second = lines("12305.50000000").splitlines()
    with pytest.raises(FileError) as caught:
        tle.parse(f"{first}\n{whole(second[:-1].replace(old, new, 1))}\n", "x")
    assert str(caught.value).startswith(f"x: line 2: {words}")


def test_a_set_that_is_not_whole_is_not_taken_for_a_name():
    """Beside a whole one it would be left out, and another one flown."""
    (first, second), other = lines("12305.50000000").splitlines(), lines("12035.50000000")
    for bad, words in (
        (f"{first[:68]}\n{second}\n", "line 3: not line 1 of an element set, .* but 68 columns"),
        (f"{first} # c\n{second}\n", "line 3: not line 1 of an element set, .* but 73 columns"),
        (f"{second}\n{first}\n", "line 3: line 2 of an element set without line 1"),
        (f"{first}\n{second[:68]}\n", "line 4: not line 2 of an element set, .* but 68 columns"),
        (f"{first}\nCRAFT\n{second}\n", "line 4: not line 2 of an element set, .* but 'CRAFT'"),
    ):
        with pytest.raises(FileError, match=f"x: {words}"):
            tle.parse(other + bad, "x")
    for name in ("1 KUNS-PF", "2 A", "1998-067A", "2018 CUBESAT 1"):
        assert tle.parse(f"{name}\n{first}\n{second}\n", "x")[0].name == name


def test_of_several_sets_of_one_epoch_the_last_one_counts_and_they_are_told():
    sets = [lines("12305.50000000"), lines("12305.50000000").replace("100.0000", "001.0000"), HISTORY[0]]
    found = tle.parse("".join(sets), "x")
    chosen = tle.choose(found, None, "x", gps(2012, 10, 31))
    assert chosen is found[1]
    assert tle.rivals(found, chosen) == 1
    assert tle.rivals(tle.parse(sets[0] + sets[0] + sets[2], "x"), found[0]) == 0
