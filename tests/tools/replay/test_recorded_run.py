"""Recordings cut into epochs and sides, ours and those of others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.decoder.time_marks import marks_in, with_session
from gnss_hil.tools.recording.formats.candump import format_lines, parse_lines
from gnss_hil.tools.recording.formats.recording import Recording
from gnss_hil.tools.replay import damage
from gnss_hil.tools.replay.compare import Comparison
from gnss_hil.tools.replay.recorded_run import open_run

EPOCHS = 12


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "run"
    words = [
        "run",
        "--bus",
        "inline",
        "--duration",
        str(EPOCHS),
        "--out",
        str(folder),
        "--quiet",
        "--no-report",
    ]
    assert main(words) == 0
    return folder


def frames_of(path: Path) -> FrameBatch:
    return parse_lines(path.read_bytes())[2]


def as_heard(recorded) -> list[FrameBatch]:
    """The run as candump would have heard it: heartbeats before it, the bench's frames, its end."""
    greeting = next(recorded.epochs()).flight[-1:]
    heard = [greeting] * 3
    for epoch in recorded.epochs():
        n = (recorded.session, epoch.number)
        heard += [
            epoch.emulator, messages.encode(messages.SYNC_ID, *n, len(epoch.emulator)),
            epoch.flight, messages.encode(messages.DONE_ID, *n, len(epoch.flight)),
        ]  # fmt: skip
    return [*heard, messages.encode(messages.END_ID, recorded.session, EPOCHS, 0)]


def written(path: Path, frames: FrameBatch) -> Path:
    path.write_bytes(format_lines(1_351_642_484_000_000 + 100 * np.arange(len(frames)), frames, "vcan0"))
    return path


def test_a_recorded_run_has_every_frame_of_a_run_on_its_side(run):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    assert (recorded.bus, recorded.first, recorded.interval_ns) == ("can0", 0, 10**9)
    epochs = list(recorded.epochs())
    assert [epoch.number for epoch in epochs] == list(range(EPOCHS))
    everything = concat([part for epoch in epochs for part in (epoch.emulator, epoch.flight)])
    assert (everything.can_id == frames_of(run / "bus.log").can_id).all()
    assert (everything.data == frames_of(run / "bus.log").data).all()
    for epoch in epochs:
        assert {recorded.codec.sender_of[i] for i in epoch.flight.can_id.tolist()} == {"FLIGHT"}
        assert "FLIGHT" not in {recorded.codec.sender_of[i] for i in epoch.emulator.can_id.tolist()}


def test_a_bus_heard_by_candump_gives_the_same_run(run, tmp_path):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    heard = open_run(Recording(written(tmp_path / "heard.log", concat(as_heard(recorded)))), None, None)
    for ours, theirs in zip(recorded.epochs(), heard.epochs(), strict=True):
        assert ours.number == theirs.number
        for side in ("emulator", "flight"):
            assert (getattr(ours, side).data == getattr(theirs, side).data).all()


@pytest.mark.parametrize("ended", [True, False])
def test_a_second_run_in_a_recording_is_left_out(run, tmp_path, ended):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    first = concat(as_heard(recorded)[: None if ended else -1])
    again = first if ended else with_session(recorded.codec, first, recorded.session % 0xFFFF + 1)
    both = open_run(Recording(written(tmp_path / "two.log", concat([first, again]))), None, None)
    assert [epoch.number for epoch in both.epochs()] == list(range(EPOCHS))
    assert sum(len(e.emulator) for e in both.epochs()) == sum(len(e.emulator) for e in recorded.epochs())
    *_, line = damage.lines(both)
    told = (
        f"behind the {EPOCHS} epochs of this run another one follows, {EPOCHS} time marks; it is not replayed"
    )
    assert line == f"{tmp_path / 'two.log'}: vcan0: {told}"
    assert damage.lines(recorded) == []


def test_another_session_is_an_intact_one(run):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    frames = frames_of(run / "bus.log")
    other = with_session(recorded.codec, frames, 0xABCD)
    marks = marks_in(recorded.codec, other)
    assert set(marks.session.tolist()) == {0xABCD}
    assert marks.epoch.tolist() == list(range(EPOCHS))
    rest = np.ones(len(frames), bool)
    rest[marks.rows] = False
    assert (other.data[rest] == frames.data[rest]).all()
    assert (other.data[:, 0] == e2e.crc(other.can_id, other.data)).all()
    assert (with_session(recorded.codec, other, recorded.session).data == frames.data).all()


def test_damaged_marks_stay_damaged(run):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    frames = frames_of(run / "bus.log")[:3]
    frames.data[0, 4] ^= 1
    assert (with_session(recorded.codec, frames, 5).data == frames.data).all()


def test_the_contract_is_the_one_that_the_heartbeats_name(tmp_path):
    folder = tmp_path / "two"
    vehicle = (Path(__file__).parents[3] / "dbc/vehicles/soyuz-ms.toml").read_text()
    antennas = vehicle.split("[[antenna]]")
    (tmp_path / "two.toml").write_text("[[antenna]]".join(antennas[:3]))
    words = [
        "run",
        "--vehicle",
        str(tmp_path / "two.toml"),
        "--bus",
        "inline",
        "--duration",
        "3",
        "--no-report",
    ]
    assert main([*words, "--out", str(folder), "--quiet"]) == 0
    assert open_run(Recording(folder / "bus.log"), None, None).codec.receivers == 2


def test_what_cannot_be_replayed_is_told(run, tmp_path):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    frames = frames_of(run / "bus.log")
    contract = recorded.codec
    beat = contract.kind_of[frames.can_id] == contract.kinds["HEARTBEAT"].number

    foreign = frames.data.copy()
    foreign[beat, 7] ^= 1
    foreign[beat, 0] = e2e.crc(frames.can_id[beat], foreign[beat])
    strange = FrameBatch(frames.t_ns, frames.can_id, frames.length, foreign)
    for name, batch, told in (
        ("strange", strange, "speaks contract"),
        ("mute", frames[~beat], "no intact heartbeat"),
        ("no-mark", frames[beat], "no intact time mark"),
    ):
        with pytest.raises(Mistake, match=told):
            open_run(Recording(written(tmp_path / f"{name}.log", batch)), None, None)
    assert open_run(Recording(tmp_path / "strange.log"), None, codec(4)).session == recorded.session
    with pytest.raises(Mistake, match="holds no bus can7; it has can0"):
        open_run(Recording(run / "bus.log"), "can7", None)
    (tmp_path / "empty.log").write_text("")
    with pytest.raises(Mistake, match="holds no frames"):
        open_run(Recording(tmp_path / "empty.log"), None, None)


def test_a_comparison_names_the_first_difference(run):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    comparison = Comparison(recorded.codec, exact=True)
    epochs = list(recorded.epochs())
    for epoch in epochs[:5]:
        comparison.add(epoch.number, epoch.flight, epoch.flight)
    assert comparison.result == "as recorded in all of 5 epochs"
    changed = FrameBatch(*(getattr(epochs[5].flight, name).copy() for name in FrameBatch.__slots__))
    changed.data[0, 7] ^= 0x10
    comparison.add(5, epochs[5].flight, changed)
    comparison.add(6, epochs[6].flight, epochs[6].flight[:-1])
    assert comparison.different == 2
    assert "in 2 of 7 epochs, first epoch 5: NAV_STATUS 040#" in comparison.result


def test_heartbeats_do_not_count_where_they_may_come_at_any_time(run):
    recorded = open_run(Recording(run / "bus.log"), None, None)
    epoch = next(recorded.epochs())
    free, strict = (Comparison(recorded.codec, exact) for exact in (False, True))
    for comparison in (free, strict):
        comparison.add(0, epoch.flight, concat([epoch.flight[-1:], epoch.flight]))
    assert (free.different, strict.different) == (0, 1)
