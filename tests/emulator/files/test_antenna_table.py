"""Antenna tables: forms met in the wild, and one line for everything that is none."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gnss_hil.emulator.files import antenna_table
from gnss_hil.emulator.files.text import FileError


def test_comments_tabs_and_the_other_side_of_the_cut():
    found = antenna_table.parse("% patch\r\n# too\n\n -5.0\t9.9\n 0  10\n5.0\t9.9\n", "a.txt")
    assert found.angle_deg.tolist() == [0, 5] and found.gain_db.tolist() == [10, 9.9]


def test_a_column_is_chosen_by_its_name():
    text = "off_deg,tx_dB,rx_dB\n0,10,3\n1,9.5,2.9\n"
    assert antenna_table.parse(text, "a.csv", "rx_dB").gain_db.tolist() == [3, 2.9]


def test_a_file_is_read(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("0 1\n180 -20\n")
    assert antenna_table.read(path).gain_db.tolist() == [1, -20]


@pytest.mark.parametrize(
    "text, column, message",
    (
        ("% nothing\n", "", "a: no line with an angle and a gain"),
        ("angle,gain\n", "", "a: angles do not start at 0 with at least two rows"),
        ("0 1\n2 x\n", "", "a: line 2: gain is 'x'; a number is needed"),
        ("0 1\n\nnan 3\n", "", "a: line 3: angle is 'nan'; a number is needed"),
        ("0 1\n181 3\n", "", "a: line 2: angle is 181; it must be -180 to 180"),
        ("0 1\n5 1e4\n", "", "a: line 2: gain is 10000; it must be -200 to 60"),
        ("0 1\n5 99\n", "", "a: line 2: gain is 99; it must be -200 to 60"),
        ("0 1\n5 -999.0\n", "", "a: line 2: gain is -999; it must be -200 to 60"),
        ("0 1\n5 2\n5 3\n", "", "a: line 3: angle is 5; it must be above 5"),
        ("0 1\n5\n", "", "a: line 2: 1 of at least 2 values"),
        ("1 1\n5 2\n", "", "a: angles do not start at 0 with at least two rows"),
        ("d,a,b\n0,1,2\n", "", "a: it has several gain columns; choose one of a, b"),
        ("d,a,b\n0,1,2\n", "c", "a: column 'c' is not there; choose one of a, b"),
    ),
)
def test_a_fault_is_one_line(text, column, message):
    with pytest.raises(FileError) as caught:
        antenna_table.parse(text, "a", column)
    assert str(caught.value) == message


ROW = st.builds("{}{}{}".format, st.integers(0, 180), st.sampled_from(" ,\t"), st.integers(-60, 20))
JUNK = st.text(alphabet="0123456789.,- \t\n%eax", max_size=80)


@given(JUNK | st.lists(ROW | JUNK, max_size=4).map(lambda rows: "\n".join(["0 3", *rows])))
@example("0 3\n20 -4\n")
def test_any_text_is_read_or_refused_in_words(text):
    try:
        found = antenna_table.parse(text, "a")
    except FileError as fault:
        assert "\n" not in str(fault)
    else:
        assert found.angle_deg[0] == 0 and np.all(np.diff(found.angle_deg) > 0)


@pytest.mark.parametrize(
    "text", ["0 5 # top\n45 3 % and\n90 -5\n", "0;5\n45; 3\n90 ;-5\n", "0\t5\n45,3\n90 -5"]
)
def test_comments_behind_and_other_separators_are_no_part_of_a_table(text):
    found = antenna_table.parse(text, "a")
    assert found.angle_deg.tolist() == [0, 45, 90]
    assert found.gain_db.tolist() == [5, 3, -5]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 5\n0.8 3\n1.57 -5\n", "angles end at 1.57, as those in radians do; degrees are read"),
        ("0 5\n1.5708 3\n3.1416 -5\n", "angles end at 3.1416, as those in radians do"),
        ("0 5\n40 -99\n90 -5\n", "gain at 40 deg is -99, between 5 and -5: leave the line out if there is"),
    ],
)
def test_what_a_table_is_likely_not_to_mean_is_refused(text, said):
    with pytest.raises(FileError, match=f"a: {said}"):
        antenna_table.parse(text, "a")
    assert antenna_table.parse("0 5\n40 -99\n90 -99\n", "a").gain_db[1] == -99
    assert antenna_table.parse("0 5\n2 3\n", "a").angle_deg[1] == 2
