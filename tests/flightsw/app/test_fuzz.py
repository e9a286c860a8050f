"""Frames that are validly protected and say anything at all."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.frames import EMPTY, batch, concat
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from tests.support import synthetic_epochs as s
from tests.support.flights import SOYUZ, soyuz
from tests.support.flown import CODEC, FakeBus, decoded

KINDS = sorted(CODEC.kinds)
EVERY_ID = np.array([i for (kind, _), i in CODEC.can_id_of.items() if kind in KINDS], np.uint32)
STYLES = {
    "any": lambda rng, shape: rng.integers(0, 256, shape, np.uint8),
    "ends": lambda rng, shape: rng.choice(np.array([0, 1, 0x7F, 0x80, 0xFF], np.uint8), shape),
    "ones": lambda rng, shape: np.full(shape, 0xFF, np.uint8),
    "zeros": lambda rng, shape: np.zeros(shape, np.uint8),
}


@pytest.fixture(scope="module")
def blocks():
    """Three consecutive blocks of 24 channels, with one frame of every other identifier in each."""
    bus = FakeBus(soyuz(), s.constellation(), nodes=(9, 10))
    rest = EVERY_ID[~np.isin(EVERY_ID, bus.block(0).can_id)]
    strangers = batch(rest, np.zeros((len(rest), 8), np.uint8))
    return [concat([block[:3], strangers, block[3:]]) for block in (bus.block(k) for k in range(3))]


def garbled(block, kinds, style, share, keep_key, rng):
    """With random payloads in a share of the frames of these kinds; the channel kept or not."""
    wanted = np.isin(CODEC.kind_of[block.can_id], [CODEC.kinds[kind].number for kind in kinds])
    rows = np.flatnonzero(wanted & (rng.random(len(block)) < share))
    data = block.data.copy()
    data[rows, 3 if keep_key else 2 :] = STYLES[style](rng, (len(rows), 5 if keep_key else 6))
    return batch(block.can_id, data, t_ns=block.t_ns)


def flown(config, garbled_blocks):
    """Whatever the frames say, no exception and no numerical warning; and what is sent is in order."""
    state, sent, heard = initial_state(config), e2e.fresh_counters(CODEC), e2e.fresh_counters(CODEC)
    session = None
    for epoch, block in enumerate([*garbled_blocks, EMPTY]):
        block, sent = e2e.protect(CODEC, block, sent, epoch)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            state, answer = flight_step(config, state, block)
        if state.mark is not None and state.mark.session != session:
            # Chance has written a whole mark of another session: a new run, whose counters begin anew.
            session, heard = state.mark.session, e2e.fresh_counters(CODEC)
        screened = screening.screen(CODEC, answer, heard)
        heard = screened.counters
        assert (screened.verdict == screening.Verdict.OK).all()
        assert len(decoded(answer, "NAV_STATUS")["mode"]) == 1
    return state


@given(
    kinds=st.one_of(st.just(KINDS), st.lists(st.sampled_from(KINDS), min_size=1, max_size=6, unique=True)),
    style=st.sampled_from(sorted(STYLES)),
    share=st.sampled_from([0.05, 0.3, 1.0]),
    keep_key=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=120, deadline=None)
def test_nothing_a_valid_frame_says_stops_the_flight(blocks, kinds, style, share, keep_key, seed):
    rng = np.random.default_rng(seed)
    config = configure(SOYUZ, "patent", {"attitude_hold_epochs": 2})
    flown(config, [garbled(block, kinds, style, share, keep_key, rng) for block in blocks])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("style", sorted(STYLES))
def test_every_kind_by_itself(blocks, kind, style):
    rng = np.random.default_rng(5)
    config = configure(SOYUZ, "prototype", {})
    flown(config, [blocks[0], *(garbled(block, [kind], style, 1.0, True, rng) for block in blocks[1:])])
