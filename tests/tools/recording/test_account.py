"""Whether the record is the flight: what is a fault of the run, what a note, what is silent."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gnss_hil.dbc.lockstep.messages import Refusal
from gnss_hil.tools.recording import account
from gnss_hil.tools.recording.account import Counted, Decoded, Heard

pytestmark = pytest.mark.verifies(
    "tools/recording/account.py",
    "tools/recording/speakers.py",
    what="Record: whether it is the flight",
    by="what master, flight software and recorder counted, compared; one stray frame at every bad moment",
    status="modelled",
)

HEARD, COUNTED, DECODED = Heard(60, 60), Counted(60, 25), Decoded(60, 25)


def faults(heard=HEARD, counted=COUNTED, decoded=DECODED) -> list[str]:
    return list(account.faults("soyuz", heard, counted, decoded))


def notes(heard=HEARD, counted=COUNTED, decoded=DECODED) -> list[str]:
    return list(account.notes("soyuz", heard, counted, decoded))


def test_a_record_on_which_all_agree_is_silent():
    assert faults() == notes() == []
    assert faults(counted=Counted()) == [], "sides that do not tell"
    assert account.reproducible(HEARD)


@pytest.mark.parametrize(
    ("heard", "counted", "decoded", "words"),
    [
        (replace(HEARD, epochs=24), COUNTED, DECODED, "24 epochs on record, the time master played 60"),
        (replace(HEARD, contested=("FLIGHT", "TIME")), COUNTED, DECODED, "by turns for FLIGHT, TIME"),
        (replace(HEARD, lost_answers=2), COUNTED, Decoded(58, 25), "2 answers came so late that"),
        (HEARD, COUNTED, Decoded(59, 25), "answered 60 epochs, 59 NAV_STATUS are on record"),
        (
            replace(HEARD, answers=0),
            COUNTED,
            Decoded(0, 25),
            "the flight software answered none of 60 epochs",
        ),
        (
            replace(HEARD, miscounts=60, miscount=(3, 9, 8)),
            COUNTED,
            DECODED,
            "BENCH_DONE of epoch 3 says 9 frames, 8 came before it, the first of 60: it counts wrong",
        ),
        (
            replace(HEARD, several=("FLIGHT",)),
            Counted(60, None),
            Decoded(60, 25, 1),
            "several peers of the bus spoke for FLIGHT, and 1 frame on record",
        ),
        (HEARD, COUNTED, Decoded(60, 24), "fixes: 24 on record, 25 flown"),
        (HEARD, COUNTED, Decoded(60, 26), "fixes: 26 on record, 25 flown"),
    ],
    ids=[
        "epochs",
        "contested",
        "lost answers",
        "answers",
        "none",
        "miscount",
        "disorder",
        "fewer fixes",
        "more fixes",
    ],
)
def test_what_the_record_lacks_or_has_of_others_is_one_line(heard, counted, decoded, words):
    (line,) = faults(heard, counted, decoded)
    assert line.startswith("soyuz: ") and words in line


@pytest.mark.parametrize(
    ("heard", "words"),
    [
        (replace(HEARD, refused={Refusal.OTHER_SESSION: 2}), "2 bench frames refused: 2 of another session"),
        (replace(HEARD, refused_marks=1), "1 time mark left out of the record"),
        (replace(HEARD, late=3), "3 answers two epochs late or more"),
        (replace(HEARD, several=("FLIGHT",)), "more than one peer of the bus spoke for FLIGHT"),
    ],
    ids=["refused", "marks", "late", "several"],
)
def test_what_changed_nothing_is_a_note_and_the_run_not_reproducible(heard, words):
    (line,) = notes(heard)
    assert line.startswith("soyuz: ") and words in line
    assert faults(heard) == []
    assert not account.reproducible(heard)


def test_noise_that_hit_upon_a_right_crc_is_a_note_where_all_fixes_are_on_record():
    assert faults(replace(HEARD, several=("FLIGHT",)), COUNTED, Decoded(60, 25, 1)) == []


def test_a_record_that_nobody_ended_may_have_fewer_fixes_than_were_flown():
    endless = replace(HEARD, ended=False)
    assert faults(endless, COUNTED, Decoded(60, 20)) == []
    assert notes(endless, COUNTED, Decoded(60, 20)) == [
        "soyuz: fixes: 20 on record, which nobody ended; 25 flown"
    ]


def test_what_faults_may_bring_about_is_a_note_where_some_are_armed():
    heard = replace(HEARD, miscounts=1, miscount=(3, 9, 8), epochs=59)
    given = "soyuz", heard, COUNTED, Decoded(58, 24)
    disturbed = list(account.faults(*given, disturbed=True))
    assert (
        len(disturbed) == 2
        and "59 epochs on record" in disturbed[0]
        and "24 on record, 25 flown" in disturbed[1]
    )
    told = list(account.notes(*given, disturbed=True))
    assert any("BENCH_DONE of epoch 3" in line for line in told)
    assert any("58 NAV_STATUS are on record" in line for line in told)
    assert {*account.faults(*given)} == {*disturbed, *told}
