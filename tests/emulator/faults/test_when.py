"""Times: windows, periods and their text, there and back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from gnss_hil.emulator.faults import when as times
from gnss_hil.emulator.faults.when import When, seconds, window

pytestmark = pytest.mark.verifies(what="Faults: where and when they strike")

NS = 1_000_000_000


def epochs(text: str, interval_ns: int = NS, origin: int = 0, last: int = 400) -> list[int]:
    found = window(When.model_validate(text), interval_ns)
    return [epoch for epoch in range(last) if found.begun(epoch, origin) is not None]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("90", 90),
        ("2m", 120),
        ("1m30s", 90),
        ("250ms", 0.25),
        ("1h", 3600),
        ("1024w", 1024 * 604_800),
        ("1.5", 1.5),
    ],
)
def test_durations(text, expected):
    assert seconds(text) == expected


@pytest.mark.parametrize("text", ["", "m", "3x", "-3"])
def test_what_is_no_duration(text):
    with pytest.raises(ValueError, match="is no time"):
        seconds(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("@2m+30s", range(120, 150)),
        ("@120..180", range(120, 180)),
        ("@390..", range(390, 400)),
        ("@..5", range(5)),
        ("@#10..#12", range(10, 12)),
        ("@398", range(398, 400)),
        ("@10+0.2", range(10, 11)),
        ("@10.2..10.5", range(11, 12)),
        ("@10..13 every=1 on=1", range(10, 13)),
        ("@10..13 every=0.2", range(10, 13)),
        ("@10..40 every=10 on=2", [10, 11, 20, 21, 30, 31]),
    ],
)
def test_windows_in_epochs_of_a_second(text, expected):
    assert epochs(text) == list(expected)


def test_windows_follow_the_interval():
    assert epochs("@2+1", 100_000_000) == list(range(20, 30))
    assert epochs("@2.05+1", 100_000_000) == list(range(21, 31)), "an epoch belongs by its mark"
    assert epochs("@30+60", 30 * NS, last=10) == [1, 2]


def test_windows_count_from_their_trigger():
    assert epochs("after first fix @5+3", origin=36) == [41, 42, 43]


def test_a_part_of_a_period_knows_its_beginning():
    found = window(When.model_validate("@10 every=10 on=3"), NS)
    assert [found.begun(k, 0) for k in (9, 10, 12, 13, 20, 22)] == [None, 10, 10, None, 20, 20]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("@10..5", "stop 5.0 is not behind start 10.0"),
        ("@10 on=3", "on goes with every"),
        ("@2x", "'2x' is no time"),
        ("p=2", "less than or equal to 1"),
        ("p=x", "p=x: not a number"),
        ("n=1.5", "n=1.5: not a whole number"),
        ("after third comand", "no event 'comand'; did you mean 'command'?"),
        ("soon", "'soon' is no time"),
        ("@10+0", "length 0 is no time; more than 0"),
        ("every=0 on=1", "every 0 is no time; more than 0"),
        ("every=2 on=0", "on 0 is no time; more than 0"),
        ("every=2 on=5", "on 5 is longer than every 2"),
        ("every=#2 on=#5", "on #5 is longer than every #2"),
        ("@101+1 @103+3", "'@101+1' and '@103+3': one of them"),
        ("p=0.5 p=0.1", "'p=0.5' and 'p=0.1': one of them"),
        ("n=3 every=2 every=3", "'every=2' and 'every=3': one of them"),
        ("after first fix when G12 tracked", "'after first fix' and 'when G12 tracked': one of them"),
    ],
)
def test_what_is_no_time(text, words):
    with pytest.raises(ValidationError) as caught:
        When.model_validate(text)
    assert words in str(caught.value)


def test_seconds_and_epochs_are_compared_where_the_interval_is_known():
    when = When.model_validate("every=2 on=#5")
    assert window(When.model_validate("every=5 on=#5"), NS).on == 5
    with pytest.raises(ValueError, match="at: on #5 is longer than every 2"):
        window(when, NS)


def test_all_mistakes_of_a_time_are_named():
    with pytest.raises(ValueError) as caught:
        times.parse("@2x p=z soon n=1 n=2".split())
    assert len(str(caught.value).splitlines()) == 4


INSTANTS = st.floats(0, 1e5).map(lambda x: round(x, 3)) | st.integers(0, 10**6).map("#{}".format)
TIMES = st.builds(
    When,
    start=INSTANTS,
    length=st.none() | INSTANTS.filter(lambda one: one not in (0, "#0")),
    probability=st.floats(0.001, 1).map(lambda x: round(x, 6)),
    count=st.none() | st.integers(1, 1000),
    after=st.none() | st.sampled_from(["first handover", "G12 tracked on aft", "RX1_RATE.cn0_dbhz < 30"]),
)


@given(TIMES)
def test_text_of_a_time_is_read_back(when):
    assert When.model_validate(times.text(when)) == when
