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
        ("rx9 off", "on: no receiver 'rx9'; there are rx1 to rx8"),
        ("RNAGE lsos", "'lsos' is no kind of fault; did you mean 'lost'?"),
        ("rx2 explode", "'explode' is no kind of fault; kinds: gnss-hil faults list"),
        ("G12 range 30 step_m=4", "range-step: step_m twice"),
        ("rx2 loss name=a name=b", "'name=a' and 'name=b': one of them"),
        ("rx2 off when RX1_RATE.cn0 < 3", "at.after: RX1_RATE has no signal 'cn0'; did you mean 'cn0_dbhz'?"),
        ("rx1 length 40", "': length: input should be less than or equal to 7, found 40"),
        ("loss", "--fault 'loss': on: which frames?"),
    ],
)
def test_what_is_said_of_a_line_that_means_nothing(text, words):
    with pytest.raises(FaultError) as caught:
        files.of_line(text)
    assert str(caught.value).startswith(f"--fault '{text}': ")
    told = str(caught.value).splitlines()
    assert words in told[0] and len(told) == (2 if text.startswith("RNAGE") else 1)


MANY = {
    "rx9 RNAGE lsos @2x p=z": (
        "'lsos' is no kind",
        "on: no receiver 'rx9'",
        "on: no place 'RNAGE'",
        "at: '2x' is no time",
        "at: p=z",
    ),
    "rx2 delay 0 foo=3 bar=4 @5 @6": (
        "no key 'foo'",
        "no key 'bar'",
        "at: '@5' and '@6'",
        "epochs: input should be greater",
    ),
    "rx1 rx2 delay 1 m": ("it takes no unit", "on: 'rx1 rx2': no frame is at both"),
    "rx9 G12 range km foo=1": ("found 'km'", "no key 'foo'", "on: no receiver 'rx9'"),
    "rx9": ("'rx9': which kind of fault?", "on: no receiver 'rx9'"),
}


@pytest.mark.parametrize("text", MANY)
def test_all_mistakes_of_a_line_are_told_in_one_go(text):
    with pytest.raises(FaultError) as caught:
        files.of_line(text)
    told = str(caught.value).splitlines()
    assert len(told) == len(MANY[text]), told
    for words in MANY[text]:
        assert any(words in line for line in told), words
    assert all(line.startswith(f"--fault '{text}': ") for line in told)


@pytest.mark.parametrize("text", MANY)
def test_those_of_a_line_in_a_file_as_well(text):
    with pytest.raises(FaultError) as caught:
        files.FILES.checked({"fault": ["rx2 of", text]}, "x")
    told = str(caught.value).splitlines()
    assert told[0].startswith("x: fault.0: 'of' is no kind") and all("x: fault.1" in one for one in told[1:])
    for words in MANY[text]:
        values = words.startswith("epochs") or "found 'km'" in words
        assert values or any(words in line for line in told), words


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            ["rx2", "off", "@2"],
            "rx2 off @2: a fault of several words is one argument, in quotes: 'rx2 off @2'",
        ),
        (["replay", "rx2", "loss", "p=0.1"], "in quotes: 'replay rx2 loss p=0.1'"),
        (["repaly", "dlay"], "did you mean 'delay'?; shipped are ack-lost, "),
    ],
)
def test_words_without_quotes_are_told_once(given, words):
    with pytest.raises(FaultError) as caught:
        files.check_quoted(given)
    assert words in str(caught.value) and str(caught.value).count("antenna-cut") <= 1


def test_what_is_quoted_or_shipped_is_let_pass(tmp_path):
    (tmp_path / "a b.toml").write_text("")
    files.check_quoted(["rx2 off", "replay", "delay.toml", str(tmp_path / "a b.toml")])
    files.check_quoted(["repaly"])


def test_no_word_is_a_place_and_a_kind():
    from gnss_hil.dbc.common.systems import SYSTEMS
    from gnss_hil.dbc.contract.messages import NODES

    assert not set(WORDS) & {*SYSTEMS, *NODES}
    assert not {word for row in KINDS.values() for word in row.words} & set(KINDS)
