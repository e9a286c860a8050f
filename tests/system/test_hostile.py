"""Frames of every hostile way, against all that listens: a part of `python -m tests.support.hostile`."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gnss_hil.tools.command_line.main import main
from tests.support import guided, hostile
from tests.support.feeder import protection
from tests.support.programs import GNSS_HIL
from tests.support.runs import children_of
from tests.support.waiting import ended, until

pytestmark = pytest.mark.slow(seconds=10)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile") / "run"
    words = ["run", "--bus", "inline", "--duration", "80", "--out", str(folder), "--quiet", "--no-report"]
    assert main(words) == 0
    return folder


@pytest.mark.verifies(
    "flightsw/app/step.py",
    what="Hostile frames",
    by="random, altered, old, masqueraded and foreign ones among those of a run; a CRC of the test's own",
    status="validated",
)
def test_nothing_raises_and_no_tested_fix_is_false(run):
    account = hostile.play(run, 20_000, 1, lambda line: None)
    told = account.told
    assert told["flight", "false though tested"] == 0
    assert told["emulator", "epochs played"] == 5 * 80  # every one, whatever was commanded
    for way in ("random", "no frames of the contract"):  # as without them, since 36 s in it is tracked
        assert told[f"flight, {way}", "right fixes"] == 44
    passed, turned = told["CRC", "pass it"], told["CRC", "turned frames"]
    expected = turned * 6 / 8 / 256  # of three bits and more, of eight numbers of bits; none of fewer
    assert abs(passed - expected) < 5 * np.sqrt(expected)


def test_its_crc_is_that_of_the_profile():
    rng = np.random.default_rng(2)
    can_id, data = rng.integers(0, 0x800, 50), rng.integers(0, 256, (50, 8)).astype(np.uint8)
    expected = [protection(int(i), bytes(d)) for i, d in zip(can_id, data, strict=True)]
    assert hostile.crc(can_id.astype(np.uint32), data).tolist() == expected


@pytest.fixture(scope="module")
def one_input(run):
    return guided.one_input(run)


@given(octets=st.binary(max_size=400))
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
def test_whatever_is_done_to_an_epoch_nothing_raises(one_input, octets):
    """What `python -m tests.support.guided` searches for hours, by what the octets reach."""
    one_input(octets)


def test_its_edits_are_heard_as_sound_frames_where_they_are_made_right():
    frame = 0x101, bytes([guided.sound((0x101, bytes(8)))[1][0], *bytes(7)])
    for right in (True, False):
        octets = bytes([right << 3, 0, 0, 7, 0x5A, *bytes(7)])  # the last octet of the first frame
        ((can_id, data),) = guided.edited([frame], [frame], octets)
        assert (can_id, data[1:]) == (0x101, bytes(6) + b"\x5a")
        assert (data[0] == protection(can_id, data)) == right


def test_a_bench_that_is_shouted_at_ends_in_words(run, tmp_path):
    """A real bus, real processes: what they heard is no record of a run, and they say so."""
    bus, out = f"embedded:{tmp_path / 'bus'}", tmp_path / "run"
    command = [*GNSS_HIL, "run", "--bus", bus, "--pace", "realtime", "--duration", "15", "--out", str(out)]
    bench = subprocess.Popen([*command, "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(lambda: children_of(bench.pid).keys() >= {"emulator", "flightsw"}, bench)
    shouting = [sys.executable, "-m", "tests.support.hostile", str(run), "--frames", "30000", "--bus", bus]
    said = subprocess.run(shouting, capture_output=True, text=True)
    assert said.returncode == 0 and "frames sent" in said.stdout, said.stderr
    _, err = ended(bench)
    assert bench.returncode == 1 and "Traceback" not in err
    assert "frames refused" in err and "gnss-hil: soyuz: several peers of the bus spoke by turns" in err
