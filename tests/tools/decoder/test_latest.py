"""What is decoded of the latest epochs: when it came, how old tracks are, what channels are asked, angles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.decoder.block import of_frames
from gnss_hil.tools.decoder.epoch_snapshot import off_boresight_rad, snapshot
from gnss_hil.tools.decoder.latest import Latest
from tests.support.live_runs import EPOCHS, epochs, soyuz

pytestmark = pytest.mark.verifies(
    "tools/decoder/latest.py",
    "tools/decoder/tracks.py",
    what="Live view: tracks and what channels are asked",
    by="loops over frames one by one: readers of ours against each other",
    status="modelled",
)

PLAN = soyuz()
(CODEC,), (VEHICLE,) = PLAN.codecs, PLAN.vehicles


def test_frames_of_another_epoch_are_rejected_with_that_reason():
    blocks = list(epochs()[0])
    blocks[40] = concat((blocks[40], blocks[35][5:6]))
    latest = Latest(CODEC, 1.0)
    latest.take([40], [blocks[40][-1:]])
    assert latest.counters.reasons == {"MIXED_EPOCH": 1}


def test_a_late_answer_is_shown_in_the_epoch_in_which_it_came():
    """At real time the fix of an epoch may come when the next one has begun."""
    blocks = epochs()[0]
    navigation = [CODEC.kinds[f"NAV_{name}"].number for name in ("STATUS", *"XYZ")]
    answer = np.isin(CODEC.kind_of[blocks[70].can_id], navigation)
    latest = Latest(CODEC, 1.0)
    last = latest.take([71], [concat((blocks[71][:3], blocks[70][answer]))])
    fix = snapshot(last, 71, VEHICLE.boresight_body).fix
    assert fix is not None and fix.epoch == 70
    assert latest.counters.reasons == {}


def held(block):
    """Every signal of an epoch, kind by kind."""
    return [block[kind][name] for kind, layout in CODEC.kinds.items() for name in layout.signals]


def test_one_look_or_many_is_the_same():
    blocks = epochs()[0]
    once, often = Latest(CODEC, 1.0), Latest(CODEC, 1.0)
    last = once.take(range(EPOCHS), blocks)
    for begin in range(0, EPOCHS, 7):
        part = blocks[begin : begin + 7]
        piecewise = often.take(range(begin, begin + len(part)), part)
    assert all(np.array_equal(a, b) for a, b in zip(held(last), held(piecewise), strict=True))
    for name in ("sat", "since", "asked"):
        np.testing.assert_array_equal(getattr(once.tracks, name), getattr(often.tracks, name))


def test_a_track_is_as_old_as_its_unbroken_row_of_epochs():
    """Against a loop over the epochs, one decoded frame after another."""
    latest = Latest(CODEC, 1.0)
    latest.take(range(EPOCHS), epochs()[0])
    since = {}
    for epoch, block in enumerate(epochs()[0]):
        now = {}
        rows = np.flatnonzero(CODEC.kind_of[block.can_id] == CODEC.kinds["SV_CLOCK"].number)
        for row in rows:
            decoded = CODEC.decode("SV_CLOCK", block.data[row : row + 1])
            place = CODEC.number_of[block.can_id[row]] - 1, decoded["channel"][0]
            sat = int(satellites.index(decoded["sat_system"], decoded["sat_number"])[0])
            same = place in since and since[place][0] == sat
            now[place] = since[place] if same else (sat, epoch)
        since = now
    assert len(since) > 10
    for (receiver, channel), (sat, epoch) in since.items():
        assert latest.tracks.sat[receiver, channel] == sat
        assert latest.tracks.since[receiver, channel] == epoch
    assert (latest.tracks.sat >= 0).sum() == len(since)


def test_what_channels_are_asked_is_what_the_last_commands_say():
    latest = Latest(CODEC, 1.0)
    latest.take(range(EPOCHS), epochs()[0])
    asked = {}
    for block in epochs()[0]:
        for row in np.flatnonzero(CODEC.kind_of[block.can_id] == CODEC.kinds["COMMAND"].number):
            decoded = {k: int(v[0]) for k, v in CODEC.decode("COMMAND", block.data[row : row + 1]).items()}
            sat = 64 * decoded["sat_system"] + decoded["sat_number"] if decoded["action"] == 1 else -1
            asked[CODEC.number_of[block.can_id[row]] - 1, decoded["channel"]] = sat
    assert sum(sat >= 0 for sat in asked.values()) > 10
    for place, sat in asked.items():
        assert latest.tracks.asked[place] == sat


@pytest.mark.verifies(
    "tools/decoder/epoch_snapshot.py",
    what="Live view: angles off boresights",
    by="SciPy rotations",
    status="validated",
)
def test_the_angle_off_boresight_against_rotation_matrices():
    random = np.random.default_rng(1)
    q = random.normal(size=4)
    q /= np.linalg.norm(q)
    boresight = random.normal(size=(3, 3))
    boresight /= np.linalg.norm(boresight, axis=1, keepdims=True)
    los = random.normal(size=(3, 5, 3)) * 2e7
    ecef_from_body = Rotation.from_quat(np.roll(q, -1)).as_matrix()  # scipy: scalar last, v_ecef = R v_body
    expected = [
        [np.arccos(np.dot(ecef_from_body @ b, l) / np.linalg.norm(l)) for l in lines]  # noqa: E741
        for b, lines in zip(boresight, los, strict=True)
    ]
    np.testing.assert_allclose(off_boresight_rad(los, q, boresight), expected, atol=1e-9)


def test_angles_of_the_patent_are_within_the_masks():
    """A channel of the assignment has its satellite inside the antenna's mask, as decoded from the bus."""
    frames = epochs()[0][-1]
    seen = snapshot(of_frames(CODEC, frames), EPOCHS - 1, VEHICLE.boresight_body)
    angles = seen.off_rad[~np.isnan(seen.off_rad)]
    assert len(angles) > 10
    assert angles.max() < VEHICLE.mask_rad.max()
    assert np.isnan(seen.off_rad[np.isnan(seen.lock)]).all()
