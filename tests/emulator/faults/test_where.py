"""Places: the frames that stand there, told by cantools from names and signals."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.faults import place as places
from gnss_hil.emulator.faults.place import Place
from gnss_hil.emulator.faults.where import receivers_of, resolve
from tests.support.faulted import CODEC, DATABASE, by_cantools, undisturbed

pytestmark = pytest.mark.verifies(what="Faults: where and when they strike")

NAMES = ("fore", "starboard", "aft", "port")
BLOCK, ANSWER = undisturbed()[100]
WITH_COMMANDS = next(answer for _, answer in undisturbed() if 0x20 in answer.can_id)


def chosen(text: str, frames=BLOCK) -> list[int]:
    where = resolve(Place.model_validate(text), CODEC, NAMES)
    return where.rows(frames).nonzero()[0].tolist()


def told(frames=BLOCK) -> list[tuple[str, str, dict]]:
    """Message, sender and signals of each frame by cantools."""
    messages = [DATABASE.get_message_by_frame_id(int(i)) for i in frames.can_id]
    rows = zip(messages, by_cantools(frames), strict=True)
    return [(m.name, m.senders[0] if m.senders else "", row) for m, row in rows]


def rows(test, frames=BLOCK) -> list[int]:
    return [k for k, one in enumerate(told(frames)) if test(*one)]


def tracks(name: str) -> set[tuple[str, int]]:
    """(receiver, channel) that track a satellite by their SV_CLOCK."""
    index = satellites.parse(name)
    return {
        (m[:3], row["channel"]) for m, _, row in told()
        if m.endswith("SV_CLOCK") and 64 * row["sat_system"] + row["sat_number"] == index
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "test"),
    [
        ("rx2", lambda m, s, row: m.startswith("RX2_")),
        ("aft", lambda m, s, row: m.startswith("RX3_")),
        ("ATT", lambda m, s, row: s == "ATT"),
        ("TIME", lambda m, s, row: s == "TIME"),
        ("RANGE", lambda m, s, row: m[4:] == "RANGE"),
        ("RX2_RATE", lambda m, s, row: m == "RX2_RATE"),
        ("rx1 SV_*", lambda m, s, row: m.startswith("RX1_SV_")),
        ("ch3", lambda m, s, row: row.get("channel") == 3),
        ("rx4 RANGE ch1,2", lambda m, s, row: m == "RX4_RANGE" and row["channel"] in (1, 2)),
        ("0x100&0x7F0", lambda m, s, row: m.startswith("RX1_") and "ALM" not in m and "HEART" not in m),
        ("0x010", lambda m, s, row: m == "TIME_MARK"),
        ("G07 RANGE", lambda m, s, row: m[4:] == "RANGE" and (m[:3], row["channel"]) in tracks("G07")),
        ("all", lambda m, s, row: True),
    ],
)
def test_what_stands_at_a_place(text, test):
    assert chosen(text) == rows(test) != []


def test_a_satellite_is_in_all_that_speaks_of_it():
    speaks = rows(
        lambda m, s, row: (
            (m[:3], row.get("channel")) in tracks("G07")
            or 64 * row.get("sat_system", 9) + row.get("sat_number", 0) == satellites.parse("G07")
        )
    )
    assert chosen("G07") == speaks and len(speaks) >= 10
    gps, glonass = chosen("gps RANGE"), chosen("glonass RANGE")
    assert sorted(gps + glonass) == chosen("RANGE") and gps and glonass


def test_what_is_sent_to_a_receiver_is_its_too():
    assert chosen("rx1", WITH_COMMANDS) == rows(lambda m, s, row: m == "RX1_COMMAND", WITH_COMMANDS) != []


def test_bench_frames_are_never_struck():
    from gnss_hil.dbc.lockstep import messages

    assert chosen("all", messages.encode(messages.SYNC_ID, 1, 1, 1)) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ATT_Q0", "no place 'ATT_Q0'; did you mean 'ATT_Q01'?"),
        ("G99", "'G99' is not a satellite name"),
        ("0x100&0x7F0,0x200", "the identifiers of a place have one mask"),
        ("fort", "no place 'fort'; did you mean 'port'?"),
    ],
)
def test_what_is_no_place(text, words):
    with pytest.raises(ValueError) as caught:
        receivers_of(Place.model_validate(text), NAMES)
    assert words in str(caught.value)


PLACES = st.builds(
    Place,
    receiver=st.lists(st.integers(1, 8) | st.sampled_from(NAMES), max_size=2).map(tuple),
    node=st.lists(st.sampled_from(["ATT", "TIME"]), max_size=1).map(tuple),
    message=st.lists(st.sampled_from(["RANGE", "SV_*", "RX2_RATE"]), max_size=2).map(tuple),
    channel=st.lists(st.integers(0, 31), max_size=3).map(tuple),
    satellite=st.lists(st.sampled_from(["G12", "R07"]), max_size=2).map(tuple),
    system=st.lists(st.sampled_from(["gps", "glonass"]), max_size=1).map(tuple),
    identifier=st.lists(st.integers(0, 0x7FF), min_size=1, max_size=2).map(tuple),
    mask=st.integers(0, 0x7FF),
)


@given(PLACES)
def test_text_of_a_place_is_read_back(place):
    assert Place.model_validate(places.text(place)) == place


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rx2 rx3", "'rx2 rx3': no frame is at both; for those at either, with a comma: rx2,rx3"),
        ("RANGE RATE", "with a comma: RANGE,RATE"),
        ("ch0 RANGE ch1", "with a comma: ch0,ch1"),
        ("G07 G12", "with a comma: G07,G12"),
        ("G07 glonass", "with a comma: G07,glonass"),
        ("aft port", "with a comma: aft,port"),
        ("0x100 0x110", "with a comma: 0x100,0x110"),
        ("rx2,ATT", "'rx2,ATT': commas are between words of one sort, found receiver and node"),
        ("all rx2", "'all' is every frame and stands alone"),
        ("rx2 all", "'all' is every frame and stands alone"),
        ("0x100&0x7F0,0x200", "one mask"),
        ("rx9", "no receiver 'rx9'; there are rx1 to rx8"),
    ],
)
def test_words_of_a_place_that_cannot_hold_together_are_refused(text, words):
    with pytest.raises(ValueError) as caught:
        places.parse(text.split())
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_all_mistakes_of_a_place_are_named():
    with pytest.raises(ValueError) as caught:
        places.parse("rx9 RNAGE,RAET ch0 ch1".split())
    told = str(caught.value).splitlines()
    assert [word in line for word, line in zip(("rx9", "RNAGE", "RAET", "ch0,ch1"), told, strict=True)] == [
        True
    ] * 4


def test_satellites_and_systems_are_alternatives():
    assert set(chosen("G07,glonass")) == set(chosen("G07")) | set(chosen("glonass")) > set(chosen("G07"))
    assert places.text(Place.model_validate("glonass,G07 RANGE")) == "G07,glonass RANGE"


def test_words_of_different_sorts_hold_together():
    assert (
        chosen("rx2 RANGE ch3")
        == sorted(set(chosen("rx2")) & set(chosen("RANGE")) & set(chosen("ch3")))
        != []
    )
