"""One-liners: what they mean, that they are read back, what is said of those that mean nothing."""

from __future__ import annotations

import pytest

from gnss_hil.emulator.faults import files, grammar
from gnss_hil.emulator.faults.kinds.registry import KINDS, WORDS
from gnss_hil.emulator.faults.models import FaultError

pytestmark = pytest.mark.verifies(
    "emulator/faults/grammar.py",
    "emulator/faults/files.py",
    "emulator/faults/spoken.py",
    "emulator/faults/models.py",
    "emulator/faults/checks.py",
    what="Faults: files and one-liners",
    by="every kind's example and every shipped file read, written as a line and read again",
    status="validated",
)


@pytest.mark.parametrize(
    ("text", "table"),
    [
        ("rx2 off @2m+30s", {"kind": "receiver-off", "on": "rx2", "at": "@2m+30s"}),
        ("ATT off @5", {"kind": "silence", "on": "ATT", "at": "@5"}),
        ("G12 range +30 m @120..180", {"kind": "range-step", "step_m": 30, "on": "G12", "at": "@120..180"}),
        ("glonass range 30m", {"kind": "constellation-bias", "step_m": 30, "on": "glonass"}),
        ("G12 ramp 2.5 m/s", {"kind": "range-ramp", "rate_mps": 2.5, "on": "G12"}),
        ("att freeze @1m+10s", {"kind": "stuck", "on": "att", "at": "@1m+10s"}),
        ("rx1 freeze", {"kind": "receiver-stuck", "on": "rx1"}),
        ("frames 0x100&0x7F0 drop p=0.1", {"kind": "loss", "on": "0x100&0x7F0", "at": "p=0.1"}),
        (
            "rx1 ch0 RANGE.pseudorange_m += 30 @ 30+10 crc = wrong",
            {"kind": "masquerade", "change": [{"signal": "RANGE.pseudorange_m", "offset": 30.0}],
             "on": "rx1 ch0", "at": "@30+10", "protection": {"crc": "wrong"}},
        ),
        (
            "rx2 off when RX1_RATE.cn0_dbhz < 30 @5s+30s n=4 name=cut",
            {"kind": "receiver-off", "on": "rx2", "name": "cut",
             "at": "when RX1_RATE.cn0_dbhz < 30 @5s+30s n=4"},
        ),
        (
            "mark-jump 1024w detected_by=mark,innovation within_epochs=1",
            {"kind": "mark-jump", "by_s": "1024w",
             "expect": {"detected_by": ["mark", "innovation"], "within_epochs": 1}},
        ),
        (
            "rx1 masquerade RANGE.pseudorange_m += 30 ATT_Q01.q0 freeze RATE.range_rate_mps -= 1 @5",
            {"kind": "masquerade", "on": "rx1", "at": "@5",
             "change": [{"signal": "RANGE.pseudorange_m", "offset": 30.0},
                        {"signal": "ATT_Q01.q0", "freeze": True},
                        {"signal": "RATE.range_rate_mps", "offset": -1.0}]},
        ),
        ("wrong-address 0x110 mask=0x7F0", {"kind": "wrong-address", "identifier": 0x110, "mask": 0x7F0}),
    ],
)  # fmt: skip
def test_what_a_line_means(text, table):
    assert grammar.parse(text) == table


@pytest.mark.parametrize("line", [row.example for row in KINDS.values()])
def test_examples_of_all_kinds_are_read_back(line):
    fault = files.of_line(line)
    assert files.of_line(grammar.line(fault)) == fault


def test_several_changes_are_read_back():
    fault = files.of_line("rx1 RANGE.pseudorange_m += 30 RATE.range_rate_mps -= 1 crc=wrong @5")
    assert files.of_line(grammar.line(fault)) == fault and len(fault.change) == 2
    table = {"kind": "masquerade", "change": "health = UNHEALTHY"}
    with pytest.raises(ValueError, match="has no line"):
        grammar.line(files.FILES.checked({"fault": [table]}, "x").fault[0])


@pytest.mark.parametrize("name", files.shipped())
def test_shipped_files_are_read_back_as_lines(name):
    for fault in files.load(files.shipped()[name]).fault:
        assert files.of_line(grammar.line(fault)) == fault


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no fault: PLACE KIND [VALUE] [@TIME], as in rx2 off @2m+30s"),
        ("rx2", "'rx2': which kind of fault?"),
        ("G12 rnage +30 m", "'rnage' is no kind of fault; did you mean 'range'?"),
        ("rx2 of @2m", "'of' is no kind of fault; did you mean 'off'?"),
        ("G99 range 30", "'G99' is not a satellite name such as G07 or R21"),
        ("rx2 delay 1 m", "delay: its value is epochs, found '1 m'; it takes no unit"),
        ("G12 range +30 km", "range-step: its value is step_m, found '+30 km'; allowed is m"),
        ("G12 range +30km", "range-step: its value is step_m, found '+30 km'; allowed is m"),
        ("rx2 delay 0", "epochs: input should be greater than or equal to 1, found 0"),
        ("rx2 loss 3", "loss takes no value, found '3'"),
        ("rx2 loss probab=3", "loss has no key 'probab'"),
        ("G12 range 30 stpe_m=3", "range-step has no key 'stpe_m'; did you mean 'step_m'?"),
        ("rx2 off @2x", "at: '2x' is no time"),
        ("rx2 loss detected_by=tiem", "expect.detected_by: no check 'tiem'"),
        ("G12 off", "on: a node (ATT, TIME) or a receiver (rx2) falls silent"),
        ("G12 slow", "on: which receiver? rx2, or the name of its antenna"),
        ("loss", 'on: which frames? on = "rx2 RANGE"'),
        ("rx2 reset", "at: needs an end, @30+5; it starts anew there"),
        ("oscillator-jump", "jumps by nothing; give jump_ns or rate_ns_per_s"),
    ],
)
def test_what_is_said_of_a_line_that_means_nothing(text, words):
    with pytest.raises(FaultError) as caught:
        files.of_line(text)
    assert str(caught.value).startswith(f"--fault '{text}': ")
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_no_word_is_a_place_and_a_kind():
    from gnss_hil.dbc.common.systems import SYSTEMS
    from gnss_hil.dbc.contract.messages import NODES

    assert not set(WORDS) & {*SYSTEMS, *NODES}
    assert not {word for row in KINDS.values() for word in row.words} & set(KINDS)
