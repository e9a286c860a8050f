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
