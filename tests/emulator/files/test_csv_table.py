"""Tables of flown states: instants with and without an offset, columns by name."""

from __future__ import annotations

from datetime import datetime

import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.files import csv_table
from gnss_hil.emulator.files.text import FileError

pytestmark = pytest.mark.verifies(
    "emulator/files/csv_table.py", what="Tables of flown states", by="ISO 8601", status="validated"
)

NOON = gpstime.from_utc(datetime(2020, 1, 1, 12))


def table(*instants, head="UTC,a,b"):
    return "\n".join((head, *(f"{instant},{k},{k + 1}" for k, instant in enumerate(instants)), ""))


@pytest.mark.parametrize(
    "noon",
    [
        "2020-01-01T12:00:00", "2020-01-01 12:00", "2020-01-01T12:00:00Z", "2020-01-01T12:00:00+00:00",
        "2020-01-01T15:00:00+03:00", "2020-01-01T06:30:00-05:30", "2020-01-02T02:00:00.000+14:00",
        " 2020-01-01T15:00:00+0300 ",
    ],
)  # fmt: skip
def test_an_offset_from_utc_counts(noon):
    found = csv_table.parse(table(noon, "2020-01-01T12:00:01Z"), ["a"], "x")
    assert found.t_ns.tolist() == [NOON, NOON + 10**9]


def test_offsets_may_change_from_row_to_row():
    """As where clocks are put back: local time repeats, the instants ascend."""
    found = csv_table.parse(table("2020-10-25T02:30:00+02:00", "2020-10-25T02:00:00+01:00"), ["a"], "x")
    assert found.t_ns[1] - found.t_ns[0] == 1800 * 10**9


def test_case_blanks_and_blank_lines_are_no_part_of_a_table():
    text = (
        "# of a program\n\n utc , B,A \n"
        + "2020-01-01T12:00:00,1, 2\n\n , , \n# on\n2020-01-01T12:00:01,3,4\n"
    )
    found = csv_table.parse(text, ["a", "b"], "x")
    assert found.columns.tolist() == [[2, 1], [4, 3]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (table("noon", "2020-01-01T12:00:01"), "x: line 2: UTC is 'noon', not a date and time"),
        (table("0001-01-01T00:00:00+14:00", "2020-01-01"), "x: line 2: UTC is '0001-01-01T00:00:00+14:00'"),
        (table("2020-01-01T12:00:00", "2020-01-01T14:00:00+03:00"), "x: line 3: UTC does not ascend"),
        (table("2020-01-01T12:00:00"), "x: 1 row; two at least are needed"),
        (table("2020-01-01T12:00:00", head="UTC,a,c"), "x: line 1: column b is missing; there are UTC, a, c"),
        (table("2020-01-01T12:00:00").replace(",0,", ",zero,"), "x: line 2: a is 'zero', not a number"),
        (table("2020-01-01T12:00:00").replace(",0,", ",nan,"), "x: line 2: a is 'nan', not finite"),
        (table("2020-01-01T12:00:00").replace(",0,", ","), "x: line 2: 2 columns; the first line names 3"),
    ],
)
def test_faults_have_a_line(text, words):
    with pytest.raises(FileError) as caught:
        csv_table.parse(text, ["a", "b"], "x")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "sep=;\nutc;a;b\n2020-01-01T12:00:00;1,5;2\n2020-01-01T12:00:01;-3,25;4\n",
        "UTC;a;b\n2020-01-01T12:00:00;1,5;2\n2020-01-01T12:00:01;-3,25;4\n",
        "UTC\ta\tb\n2020-01-01T12:00:00\t1.5\t2\n2020-01-01T12:00:01\t-3.25\t4\n",
        '"sep=,"\nUTC,a,b\n2020-01-01T12:00:00,1.5,2\n2020-01-01T12:00:01,-3.25,4\n',
        "UTC,a,b # head\n2020-01-01T12:00:00,1.5,2 # one, two\n2020-01-01T12:00:01,-3.25,4\t# on\n",
        "UTC,a,b\n2020-01-01T12:00:00,1.5,2,,\n2020-01-01T12:00:01,-3.25,4,\n",
        "UTC,a,b\n2020-01-01 12:00:00 UTC,1.5,2\n2020-01-01 12:00:01GMT,-3.25,4\n",
    ],
)
def test_separators_comments_and_names_of_utc_are_no_part_of_a_table(text):
    found = csv_table.parse(text, ["a", "b"], "x")
    assert found.t_ns.tolist() == [NOON, NOON + 10**9]
    assert found.columns.tolist() == [[1.5, 2], [-3.25, 4]]


def test_a_leap_second_is_a_second():
    found = csv_table.parse(
        table("2016-12-31T23:59:59", "2016-12-31T23:59:60", "2016-12-31T23:59:60.5", "2017-01-01T00:00:00"),
        ["a"],
        "x",
    )
    assert (found.t_ns - found.t_ns[0]).tolist() == [0, 10**9, 1_500_000_000, 2 * 10**9]
