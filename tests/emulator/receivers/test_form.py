"""Forms against the codec, kind by kind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dbc.codec import codec
from dbc.contract import MEASUREMENT_KINDS
from emulator.receivers.form import form

CODEC = codec(4)
KINDS = [MEASUREMENT_KINDS, ("TIME_MARK", "TIME_GPS", "TIME_FINE"), ("TAG", "STATUS"), ("ACK",),
         ("ALM_XY", "ALM_Z", "ALM_V"), ("ATT_Q01", "ATT_Q23", "ATT_RATE")]  # fmt: skip


def limits(name, kinds):
    """Range of a signal [physical] that every kind with it can carry."""
    low, high = -np.inf, np.inf
    for kind in kinds:
        layout = CODEC.kinds[kind]
        if name in layout.signals:
            i = layout.signals.index(name)
            low = max(low, layout.raw_min[i] * layout.factor[i] + layout.offset[i])
            high = min(high, layout.raw_max[i] * layout.factor[i] + layout.offset[i])
    return low, high


@pytest.mark.parametrize("kinds", KINDS, ids=lambda kinds: kinds[0])
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32), n=st.integers(0, 7))
def test_a_form_is_its_kinds_encoded_one_by_one(kinds, seed, n):
    paper, random = form(CODEC, kinds), np.random.Generator(np.random.PCG64(seed))
    values = {name: random.uniform(*limits(name, kinds), n) for name in paper.names}
    payloads, fits = paper.fill(n, values)
    assert fits.all()
    for i, kind in enumerate(kinds):
        own = {name: values[name] for name in CODEC.kinds[kind].signals if name in values}
        assert payloads[:, i].tobytes() == CODEC.encode(kind, own, n).tobytes()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 5e8, -1.0])
def test_what_does_not_fit_marks_its_frame_and_no_other(bad):
    paper = form(CODEC, MEASUREMENT_KINDS)
    values = dict.fromkeys(paper.names, 0)
    values["pseudorange_m"] = np.array([2.1e7, bad, 2.2e7])
    payloads, fits = paper.fill(3, values)
    assert fits[:, 1:].all()
    assert fits[:, 0].tolist() == [True, False, True]
    assert CODEC.decode("RANGE", payloads[:, 0])["pseudorange_m"][[0, 2]].tolist() == [2.1e7, 2.2e7]
