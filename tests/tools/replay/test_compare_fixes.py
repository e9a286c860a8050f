"""Another's fixes against those recorded."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract import codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, batch, concat
from gnss_hil.tools.replay.compare import Comparison
from gnss_hil.tools.replay.compare_fixes import SIGMAS, FixComparison

pytestmark = pytest.mark.verifies(
    "tools/replay/compare_fixes.py",
    what="Fixes of another flight software against a recording",
    by="fixes made by hand, metres apart",
    status="validated",
)

CODEC = codec.codec(4)
HERE_M = np.array([3.1e6, 2.2e6, 5.6e6])


def frames_of(kind: str, number: int = 0, **values) -> FrameBatch:
    return batch(CODEC.can_id_of[kind, number], CODEC.encode(kind, values, 1))


def fix(off_m: float = 0.0, sigma_m: float = 1.0, boots: int = 0) -> FrameBatch:
    parts = [frames_of("NAV_STATUS", mode=1, satellites=9, measurements=9, pdop=1.25)]
    parts += [
        frames_of(f"NAV_{a.upper()}", **{f"{a}_m": HERE_M[i] + off_m * (i == 0)}) for i, a in enumerate("xyz")
    ]
    parts.append(frames_of("NAV_SIGMA", sigma_x_m=sigma_m, sigma_y_m=0, sigma_z_m=0))
    return concat([*parts, frames_of("HEARTBEAT", 10, state=2, boot_count=boots)])


NONE = frames_of("NAV_STATUS", mode=0, no_fix=1)


def compared(*pairs: tuple[FrameBatch, FrameBatch]) -> FixComparison:
    found = FixComparison(CODEC, Comparison(CODEC, exact=True))
    for number, (recorded, heard) in enumerate(pairs):
        found.add(number, recorded, heard)
    return found


def test_heartbeats_of_another_program_are_no_difference():
    found = compared((fix(), fix(boots=7)), (fix(), fix(0.5)))
    assert found.different == 0
    assert found.result == (
        "fixes in 2 epochs of both, 0.25 m apart in the median, 0.475 m p95, 0.5 m at most"
    )


def test_frames_as_recorded_are_told_so():
    assert compared((fix(), fix()), (NONE, NONE)).result == "as recorded in all of 2 epochs"


def test_fixes_on_one_side_and_those_that_contradict_are_different():
    limit_m = SIGMAS * 2**0.5
    pairs = [(fix(), NONE), (NONE, fix()), (fix(), fix(limit_m * 1.01)), (fix(), fix(limit_m * 0.99))]
    found = compared(*pairs, (NONE, EMPTY))
    assert (found.only_recorded, found.only_heard, found.contradicting, found.different) == (1, 1, 1, 3)
    assert "1 in the recording alone; 1 in the answer alone; 1 more than 5 sigma apart" in found.result
    assert found.result.endswith("first in epoch 0: no fix where one is recorded")


def test_what_is_no_frame_of_the_contract_is_passed_over():
    strange = batch([0x7A0, 0x123], np.full((2, 8), 255))
    assert compared((fix(), concat([strange, fix(0.1)]))).contradicting == 0
