"""What the report draws epoch by epoch, read back from frames."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.results.tables import EPOCHS, FIXES, columns_of
from tests.tools.decoder.test_digest import FIVE, SECOND, USED, Sender, digested, frames_of, navigation

QUATERNION = (0.5, -0.5, 0.5, -0.5)


def attitude():
    q0, q1, q2, q3 = QUATERNION
    return concat([frames_of("ATT_Q01", q0=q0, q1=q1), frames_of("ATT_Q23", q2=q2, q3=q3)])


def doubts():
    return concat(
        [
            frames_of("NAV_SIGMA", sigma_x_m=1.25, sigma_y_m=2.5, sigma_z_m=655.35),
            frames_of("NAV_CORR", rho_xy=0.5, rho_xz=-0.25, rho_yz=0.125),
        ]
    )


def test_attitude_load_and_refused_frames_belong_to_their_epochs():
    sender = Sender()
    blocks = [sender.block(0, attitude(), navigation()), sender.block(1, navigation(mode=0))]
    blocks[1].data[-1, 3] ^= 1  # a bit error in the second epoch
    digest, _ = digested(*blocks)
    timeline = digest.timeline
    assert (timeline["t_ns"] // 10**9 % 604_800).tolist() == [SECOND, SECOND + 1]
    assert timeline["bits"].tolist() == [int(frame_bits(block).sum()) for block in blocks]
    assert timeline["faults"].tolist() == [0, 1]
    assert digest.counters.reasons == {"CORRUPTED": 1}
    assert [timeline[f"q{i}"][0] for i in range(4)] == pytest.approx(QUATERNION)
    assert np.isnan(timeline["q0"][1])
    columns = columns_of(EPOCHS, "soyuz", timeline)
    assert columns["frames_rejected"].tolist() == [0, 1]
    assert columns["q3_body_from_ecef"][0] == pytest.approx(QUATERNION[3])


def test_a_fix_tells_its_standard_deviations_and_one_without_them_is_still_a_fix():
    sender = Sender()
    digest, _ = digested(
        sender.block(0, *FIVE, navigation(used=USED), doubts()), sender.block(1, *FIVE, navigation(used=USED))
    )
    assert digest.fixes["valid"].tolist() == [True, True]
    columns = columns_of(FIXES, "soyuz", digest.fixes)
    assert [columns[f"sigma_{a}_ecef_m"][0] for a in "xyz"] == [1.25, 2.5, 655.35]
    assert [columns[f"rho_{pair}"][0] for pair in ("xy", "xz", "yz")] == [0.5, -0.25, 0.125]
    assert np.isnan(columns["sigma_x_ecef_m"][1])


def test_a_handover_is_noted_when_it_was_commanded():
    def track(receiver, transaction):
        return frames_of("COMMAND", receiver, channel=0, action=1, sat_number=7, transaction=transaction)

    def release(receiver, transaction):
        return frames_of("COMMAND", receiver, channel=0, action=0, sat_number=7, transaction=transaction)

    sender = Sender()
    digest, _ = digested(sender.block(0, track(1, 1)), sender.block(1, release(1, 2), track(4, 3)))
    ((t_ns, satellite, before, after),) = digest.commands.handed
    assert (t_ns // 10**9 % 604_800, satellite, before, after) == (SECOND + 1, 7, 1, 4)
    assert digest.commands.handovers == 1
