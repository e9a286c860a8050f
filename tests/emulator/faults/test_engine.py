"""The engine: pure, keyed by the seed, in windows, by chance, by number, at triggers."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import EFF_FLAG, batch, concat
from gnss_hil.emulator.faults import engine
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.emulator.faults.models import FaultError
from tests.support.faulted import CODEC, EPOCHS, NS, of_kind, plan_of, strike, undisturbed

pytestmark = pytest.mark.verifies(
    "emulator/faults/engine.py",
    "emulator/faults/base.py",
    "emulator/faults/place.py",
    "emulator/faults/where.py",
    "emulator/faults/when.py",
    "emulator/faults/triggers.py",
    "emulator/faults/kinds/row.py",
    "emulator/faults/kinds/registry.py",
    "emulator/faults/kinds/inside.py",
    what="Faults: where and when they strike",
    by="frames counted one by one in an undisturbed run; cantools; the library autosar-e2e",
    status="validated",
)


def touched(struck) -> list[int]:
    return [sum(event.touched for event in one.events) for one in struck]


def test_what_never_acts_changes_no_byte():
    struck = strike("all loss @500", "rx1 delay @#400", "G12 range 30 @1h", "ATT freeze after 999th command")
    assert all(one.block == one.before for one in struck)
    assert all(one.answer == answer for one, (_, answer) in zip(struck, undisturbed(), strict=True))
    assert not any(one.events for one in struck)


def test_a_window_is_from_its_first_epoch_to_the_last_before_its_end():
    struck = strike("rx2 loss @100+5")
    expected = [int((CODEC.number_of[block.can_id] == 2).sum()) for block, _ in undisturbed()]
    for epoch, one in enumerate(struck):
        left_out = len(one.before) - len(one.block)
        assert left_out == (expected[epoch] if 100 <= epoch < 105 else 0), epoch
    assert [event.since for one in struck for event in one.events if event.direction is Direction.FLIGHT] == [
        100
    ] * 5


def test_draws_are_those_of_the_seed():
    line = "rx1,rx2,rx3,rx4 loss p=0.1 @40"
    once, again, other = strike(line), strike(line), strike(line, seed=2)
    assert all(a.block == b.block for a, b in zip(once, again, strict=True))
    assert any(a.block != b.block for a, b in zip(once, other, strict=True))
    total = sum(len(one.before) for one in once[40:])
    lost = sum(touched(once))
    placed = total - 9 * (EPOCHS - 40)  # mark, attitude, its heartbeat and that of TIME are elsewhere
    assert abs(lost - 0.1 * placed) < 5 * np.sqrt(0.09 * placed)


def test_a_number_of_frames_is_that_number():
    struck = strike("rx3 RANGE loss n=7 @100")
    assert sum(touched(struck)) == 7
    assert sum(len(of_kind(one.before, "RANGE")) - len(of_kind(one.block, "RANGE")) for one in struck) == 7


def test_a_number_counts_frames_that_are_struck_not_what_becomes_of_them():
    struck = strike("rx3 RANGE repetition 4 n=7 @100")
    added = sum(len(of_kind(one.block, "RANGE")) - len(of_kind(one.before, "RANGE")) for one in struck)
    assert added == 28


def test_a_period_comes_again():
    acts = [epoch for epoch, one in enumerate(strike("TIME loss @10..100 every=20 on=2s")) if one.events]
    assert acts == [10, 11, 30, 31, 50, 51, 70, 71, 90, 91]


def test_an_epoch_again_from_the_same_state_is_the_same():
    plan = plan_of("rx1 delay 2 p=0.5", "ATT freeze", "rx2 replay 3")
    state = engine.fresh(plan)
    for epoch, (block, _) in enumerate(undisturbed()[:50]):
        at = At(epoch, epoch * NS, Direction.FLIGHT)
        first, again = engine.inject(plan, state, block, at), engine.inject(plan, state, block, at)
        assert first[1] == again[1] and first[2] == again[2]
        state = first[0]


def test_faults_act_one_after_the_other():
    both = strike("ATT_Q01.q0 = 0.25 @100+1", "ATT_Q01.q0 *= 2 @100+1")[100].block
    rows = of_kind(both, "ATT_Q01")
    assert CODEC.decode("ATT_Q01", rows.data)["q0"] == pytest.approx([0.5], abs=1e-6)


def test_a_trigger_is_where_the_window_counts_from():
    blocks = undisturbed()
    commanded = next(k for k, (_, answer) in enumerate(blocks) if len(of_kind(answer, "COMMAND")))
    struck = strike("ATT loss after first command @3+2")
    acts = [epoch for epoch, one in enumerate(struck) if one.block != one.before]
    assert acts == [commanded + 3, commanded + 4]


@pytest.mark.parametrize("time", ["@0+10", "@..10", "@#0+#10"])
def test_a_window_that_an_answer_opens_is_as_long_as_it_says(time):
    blocks = undisturbed()
    commanded = next(k for k, (_, answer) in enumerate(blocks) if len(of_kind(answer, "COMMAND")))
    struck = strike(f"ATT loss after first command {time}")
    acts = [epoch for epoch, one in enumerate(struck) if one.block != one.before]
    # The frames of the epoch have left when it is answered: the next is the first that can be struck.
    assert acts == list(range(commanded + 1, commanded + 11))
    lost = strike(f"command-lost after first command {time}")
    assert len(of_kind(lost[commanded].before, "COMMAND")) == 0 and not len(
        of_kind(lost[commanded].answer, "COMMAND")
    )
    acts = [event.epoch for one in lost for event in one.events]
    assert acts == list(range(commanded, commanded + 10)), "what is answered can be struck at once"


def test_a_window_that_the_emulators_frames_open_begins_with_them():
    tracked = next(k for k, (block, _) in enumerate(undisturbed()) if len(of_kind(block, "SV_CLOCK")))
    struck = strike("ATT loss after RX1_RATE.cn0_dbhz > 0 @0+2", "ATT loss when RATE.cn0_dbhz > 0 @0+2")
    acts = [epoch for epoch, one in enumerate(struck) if one.block != one.before]
    assert acts[0] == tracked


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("rx2 asymmetric", "run cannot do it: everybody on one bus hears the same; gateway and cangw can"),
        ("rx7 loss", "no receiver rx7; the craft has rx1 to rx4"),
        ("fort loss", "no place 'fort'; did you mean 'port'?"),
        ("rx2 TIME loss", "no frame of this bus is at 'rx2 TIME'"),
        ("ATT RANGE.pseudorange_m += 3", "it acts on RANGE, and 'ATT' has none of them"),
        ("rx1 oscillator-jump 100", "rx2, rx3, rx4 is on the same oscillator; name it too"),
    ],
)
def test_what_cannot_be_is_refused_by_name(line, words):
    with pytest.raises(FaultError, match=r"fault\.0: ") as caught:
        plan_of(line, link="run")
    assert words in str(caught.value)


def test_what_needs_the_emulators_inside_is_refused_by_a_gateway():
    with pytest.raises(
        FaultError, match="gateway cannot do it: it needs the emulator's link budget; run can"
    ):
        plan_of("jammer", link="gateway")
    for line in ("rx1 jammer", "jammer p=0.5", "jammer after first fix", "jammer every=10"):
        with pytest.raises(FaultError, match="a jammer"):
            plan_of(line)


def test_every_mistake_is_told():
    with pytest.raises(FaultError) as caught:
        plan_of("rx7 loss", "rx2 loss", "rx2 asymmetric", link="run")
    assert [line.partition(":")[0] for line in str(caught.value).splitlines()] == ["fault.0", "fault.2"]


def test_frames_that_no_codec_knows_pass():
    odd = concat([batch([0x12345 | EFF_FLAG], bytes(8)), batch([0x7FF], b"\1\2"), batch([0x3A5], bytes(8))])
    plan = plan_of(
        "all garbage", "all stuck", "all counter freeze", "G12 range 30", "all corruption 1 p=0.0001"
    )
    _, out, _ = engine.inject(plan, engine.fresh(plan), odd, At(0, 0, Direction.FLIGHT))
    assert out.can_id.tolist() == odd.can_id.tolist()
