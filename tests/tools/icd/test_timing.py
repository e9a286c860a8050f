"""Time axis and budget: the figures of `gnss-hil icd budget`, and a real epoch's order."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.emulator.assemble import initial_state
from gnss_hil.emulator.step import emulate_step
from gnss_hil.tools.icd import prose, timing
from gnss_hil.tools.run_config.plan import make
from tests.support.icd_pages import subject_of, tree, words

pytestmark = pytest.mark.verifies(
    what="Interface control document: formulas, sequence charts, an epoch on a time axis",
)

(BUS,) = subject_of().buses


def test_the_pieces_are_the_steady_budget():
    both = timing.pieces(BUS.budget, "emulator") + timing.pieces(BUS.budget, "flight")
    assert sum(piece.frames for piece in both) == BUS.budget.frames(events=False)
    drawn = [e for e in tree().iter() if e.get("data-what")]
    assert [(e.get("data-what"), int(e.get("data-frames"))) for e in drawn] == [
        (p.what, p.frames) for p in both
    ]


def test_widths_are_to_scale():
    drawn = [e for e in tree().iter() if e.get("data-what")]
    per_frame = [float(e.get("width")) / int(e.get("data-frames")) for e in drawn]
    assert np.allclose(per_frame, per_frame[0], rtol=1e-4)


def test_the_order_drawn_is_the_order_of_a_real_epoch():
    plan = make("soyuz")
    state = initial_state(plan.world)
    _, sent, _ = emulate_step(plan.world, state, {}, 0)
    group = {
        m.frame_id: layout.group.name for layout in subject_of().contract.layouts for m in layout.messages
    }
    closing = {"TAG": "tags and status", "STATUS": "tags and status"}
    name = {
        m.frame_id: closing.get(layout.name, layout.group.name)
        for layout in subject_of().contract.layouts
        for m in layout.messages
    }
    assert set(group.values()) >= set(name.values()) - {"tags and status"}
    heard = list(dict.fromkeys(name[i] for i in sent["soyuz"].can_id.tolist()))
    drawn = [piece.what for piece in timing.pieces(BUS.budget, "emulator")]
    assert [what for what in drawn if what in heard] == heard
    assert set(drawn) - set(heard) <= {"measurements"}  # nothing is tracked yet


def test_flight_sends_one_of_the_heartbeats():
    numbers = {n for kind, n in subject_of().contract.codec.can_id_of if kind == "HEARTBEAT"}
    row = next(r for r in BUS.budget.rows if r.what == "heartbeats")
    assert FLIGHT_NODE in numbers
    assert (row.frames, row.flight) == (len(numbers), 1)


def test_the_contracts_page_has_this_budget():
    """docs/contract.md says that its table is what `gnss-hil icd budget soyuz` writes."""
    assert BUS.budget.table() in prose.sections()["Frame budget"]


def test_the_table_has_the_figures_of_the_budget():
    shown = words(tree())
    for row in BUS.budget.rows:
        assert f"{row.what} {row.frames} " in shown
    assert BUS.budget.loads() in shown
