"""What a fault can strike at its place: one that could never do anything is refused before the start."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.faults import engine, files
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.models import FaultError
from gnss_hil.tools.command_line.main import main
from tests.support.emulated import document
from tests.support.faulted import CODEC, NS, VEHICLE, of_kind, plan_of, strike

pytestmark = pytest.mark.verifies(
    "emulator/faults/reach.py",
    what="Faults: those that could never act are refused",
    by="lines that name what this vehicle, contract or sky does not have, and their neighbours that act",
    status="validated",
)

SKY = np.isin(np.arange(satellites.SATELLITES), [satellites.parse(name) for name in ("G07", "G12", "R05")])


def refusal(line: str, link: str | None = None) -> str:
    with pytest.raises(FaultError) as caught:
        engine.armed([files.of_line(line)], "soyuz", VEHICLE, CODEC, NS, 1, link=link, sky=SKY)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("ch9 loss", "on: no channel ch9; the craft has ch0 to ch5"),
        ("rx2 ch0,9 loss", "on: no channel ch9; rx2 has ch0 to ch5"),
        ("0x7F8 loss", "on: no frame of this bus is at '0x7F8'"),
        ("E11 range +30 m", "on: no satellite E11; the scenario has gps, glonass"),
        ("G13 range +30 m", "on: no satellite G13 in the scenario; did you mean 'G12'?"),
        ("galileo range +30 m", "no place 'galileo'"),
        ("ch6 loss", "on: no channel ch6"),
        ("rx2 loss when E11 tracked", "at.after: no satellite E11; the scenario has gps, glonass"),
        ("rx2 loss when G12 tracked on rx9", "at.after: no receiver 'rx9'; did you mean 'rx"),
        ("rx1 RATE range +30 m", "on: it acts on RANGE, PHASE, and 'rx1 RATE' has none of them"),
        ("rx1 PHASE range +30 m carrier=false", "on: it acts on RANGE, and 'rx1 PHASE' has none"),
        ("rx2 RANGE command-lost", "on: it acts on COMMAND"),
        ("rx2 COMMAND ack-lost", "on: it acts on ACK"),
        ("rx2 COMMAND receiver-slow", "on: it does nothing to what is at 'rx2 COMMAND'"),
        ("rx2 HEARTBEAT receiver-stuck", "on: it acts on "),
        ("TIME_GPS mark-jump 1s", "name both"),
        ("ATT mark-missing", "on: it acts on TIME_MARK, TIME_GPS, TIME_FINE"),
        ("rx1 RANGE wrong-address 0x100 mask=0x700", "identifier: 0x100 is the frames' own"),
    ],
)
def test_what_could_never_act_is_refused(line, words):
    assert words in refusal(line)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("rx1 range +0 m", "step_m: steps by nothing, found 0"),
        ("G12 ramp 0 m/s", "rate_mps: grows by nothing, found 0"),
        ("glonass bias 0 m", "step_m: steps by nothing, found 0"),
        ("G12 wrong-coordinates 1", "factor: moves nothing, found 1"),
        ("rx1 counter offset", "by: an offset of 0 changes nothing"),
        ("rx1 crc offset", "by: an offset of 0 changes nothing"),
        ("rx1 corruption flip=0000000000000000", "flip: turns no bit over"),
        ("rx2 babbling", "on: babbling takes no place; its frames are new"),
        ("rx2 insertion identifier=0x3A5", "on: insertion takes no place"),
        ("ATT stray-bench SYNC", "on: stray-bench takes no place"),
    ],
)
def test_what_would_change_nothing_is_refused(line, words):
    with pytest.raises(FaultError) as caught:
        files.of_line(line)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "line",
    [
        "ch5 loss", "0x100&0x700 loss", "G12 range +30 m", "glonass range +30 m", "rx2 loss when R05 tracked",
        "rx1 RATE range-ramp 2 m/s", "rx1 TAG oscillator 10 ns rx2", "FLIGHT silence", "NAV_STATUS loss",
    ],
)  # fmt: skip
def test_their_neighbours_are_armed(line):
    line = "rx1,rx2,rx3,rx4 TAG oscillator 10 ns" if "TAG" in line else line
    assert engine.armed([files.of_line(line)], "soyuz", VEHICLE, CODEC, NS, 1, sky=SKY).armed


def test_a_sky_that_is_not_known_refuses_no_satellite():
    assert plan_of("E11 range +30 m", "rx2 loss when E11 tracked").armed


def test_frames_of_a_fault_before_may_be_struck():
    inserted = "insertion identifier=0x3A5 frames=2 @100+1"
    left = strike(inserted, "0x3A5 loss n=1 @100+1")[100]
    assert len(left.block) == len(left.before) + 1
    assert plan_of("babbling identifier=0x7F8", "0x7F8 loss").armed
    assert plan_of("rx1 RANGE wrong-address 0x7F8", "0x7F8 loss").armed
    assert "0x7F8" in refusal("0x7F8 loss")


@pytest.mark.parametrize(
    "line", ["FLIGHT silence @36+5", "FLIGHT restart @36+5", "FLIGHT off @3", "ATT,FLIGHT off"]
)
def test_a_flight_computer_cannot_fall_silent_in_a_run(line):
    assert "run cannot do it to '" in refusal(line, "run") and "gateway can" in refusal(line, "run")
    assert engine.armed([files.of_line(line)], "soyuz", VEHICLE, CODEC, NS, 1, link="gateway").armed


@pytest.mark.parametrize(
    "line", ["NAV_Z.z_m += 100", "NAV_STATUS.satellites = 3", "NAV_* loss", "NAV_Z delay"]
)
def test_a_run_cannot_change_what_nobody_hears(line):
    said = refusal(line, "run")
    assert "run cannot do it to 'NAV_" in said and "receivers take its commands alone" in said


def test_a_run_strikes_commands_alone_of_the_flight_softwares():
    every, heard = plan_of("FLIGHT loss"), plan_of("FLIGHT loss", link="run")
    commands = [CODEC.can_id_of["COMMAND", r] for r in range(1, 5)]
    assert np.flatnonzero(heard.armed[0].where.identifiers).tolist() == commands
    assert every.armed[0].where.identifiers.sum() > len(commands)


def test_a_silent_flight_computer_sends_nothing():
    struck = strike("FLIGHT silence @100+2")
    assert [len(one.answer) for one in struck[100:102]] == [0, 0] and len(struck[102].answer) > 10
    events = [e for one in struck[100:102] for e in one.events]
    assert {e.direction for e in events} == {Direction.RECEIVERS} and all(e.touched for e in events)


def test_a_flight_computer_starts_anew():
    struck = strike("FLIGHT restart @60+3")
    assert not len(struck[62].answer)
    beat = next(
        of_kind(one.answer, "HEARTBEAT") for one in struck[63:] if len(of_kind(one.answer, "HEARTBEAT"))
    )
    assert beat.data[0, 1] & 15 == 0


def test_a_silent_receiver_is_still_commanded():
    plan = plan_of("rx2 silence")
    assert list(plan.armed[0].actions) == [Direction.FLIGHT]


@pytest.mark.parametrize("lines", [["rx2 ack-lost @30..60"]])
def test_a_kind_strikes_its_own_messages_alone(lines):
    for one in strike(*lines)[30:60]:
        lost = one.before.can_id[~np.isin(one.before.can_id, one.block.can_id)]
        assert set(lost.tolist()) <= {CODEC.can_id_of["ACK", 2]}


def test_a_run_knows_its_sky():
    given = scenario.parse({**document(), "fault": ["E11 range +30 m", "rx2 loss", "ch9 loss"]}, "test")
    with pytest.raises(ScenarioError) as caught:
        assemble.build_world(given, [VEHICLE], 1)
    told = str(caught.value).splitlines()
    assert len(told) == 2 and "E11" in told[0] and "ch9" in told[1]


def test_a_check_knows_the_systems_of_its_scenario(capsys):
    assert main(["faults", "check", "E11 range +30 m", "ch9 loss", "0x7FF loss", "rx2 loss"]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert len(told) == 3 and [word in line for word, line in zip(("E11", "ch9", "0x7FF"), told, strict=True)]
    assert main(["faults", "check", "G12 range +30 m", "glonass range +30 m"]) == 0
