"""The checked-in DBC: generated, clean for other people's tools, and what DESIGN promises a third party."""

from __future__ import annotations

import logging
import re
from dataclasses import replace
from importlib import resources
from pathlib import Path

import pytest
from cantools.database import load_string

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract import messages as contract
from gnss_hil.dbc.contract.allocation import BENCH_FIRST, BENCH_LAST, UDS_FIRST, UDS_LAST, check
from gnss_hil.dbc.contract.generate import dbc_text
from gnss_hil.dbc.contract.messages import KINDS, NODES, messages

CHECKED_IN = resources.files("gnss_hil.dbc.contract").joinpath("gnss.dbc")


def test_checked_in_file_is_what_the_generator_writes():
    assert CHECKED_IN.read_text("ascii") == dbc_text(4)


@pytest.mark.parametrize("receivers", range(1, MAX_RECEIVERS + 1))
def test_cantools_loads_every_size(receivers):
    database = load_string(dbc_text(receivers), "dbc", strict=True)
    assert len(database.messages) == len(list(messages(receivers)))


@pytest.mark.verifies(
    "dbc/contract/messages.py",
    "dbc/contract/values.py",
    "dbc/contract/layout.py",
    "dbc/contract/allocation.py",
    "dbc/contract/generate.py",
    what="DBC file",
    by="cantools (strict) and canmatrix load it without a warning",
    status="validated",
)
def test_canmatrix_loads_without_a_warning(caplog):
    import canmatrix.formats

    with caplog.at_level(logging.DEBUG, "canmatrix"):
        (matrix,) = canmatrix.formats.loadp(str(CHECKED_IN)).values()
    assert [r for r in caplog.records if r.levelno >= logging.WARNING] == []
    assert matrix.load_errors == []
    assert len(matrix.frames) == len(list(messages(4)))
    assert matrix.attribute("Baudrate") == "1000000"
    assert {ecu.name for ecu in matrix.ecus} == {"RX1", "RX2", "RX3", "RX4", "ATT", "TIME", "FLIGHT"}


def test_sizes_and_names_fit_classical_can():
    for m in messages(MAX_RECEIVERS):
        assert 0 < m.can_id <= 0x7FF
        assert len(m.name) <= 32
        assert all(len(s.name) <= 32 for s in m.kind.signals)
        ends = [s.start + s.bits for s in m.kind.signals]
        starts = [s.start for s in m.kind.signals]
        assert max(ends) <= 64
        assert all(end <= start for end, start in zip(ends, starts[1:], strict=False)), m.name


def test_identifiers_are_unique_and_ordered_by_purpose():
    every = list(messages(MAX_RECEIVERS))
    assert len({m.can_id for m in every}) == len(every)
    order = ["TIME_MARK", "COMMAND", "NAV_STATUS", "RANGE", "ALM_XY", "HEARTBEAT", "BENCH_SYNC"]
    lowest = [min(m.can_id for m in every if m.kind.name == name) for name in order]
    assert lowest == sorted(lowest)
    for m in every:
        assert m.kind.name.startswith("BENCH_") == (BENCH_FIRST <= m.can_id <= BENCH_LAST)
        assert not UDS_FIRST <= m.can_id <= UDS_LAST


def test_every_message_and_signal_is_explained_and_addressed():
    for m in load_string(dbc_text(4), "dbc").messages:
        assert m.comment, m.name
        assert m.senders, m.name
        for s in m.signals:
            assert s.comment, f"{m.name}.{s.name}"
            assert s.receivers, f"{m.name}.{s.name}"
            assert s.minimum is not None and s.maximum is not None


@pytest.mark.parametrize(
    ("signal", "kind", "least", "step"),
    [
        ("pseudorange_m", "RANGE", 200e6, 1e-3),  # 1 mm over 200,000 km
        ("x_m", "SV_X", 42.2e6, 1e-3),  # a geostationary augmentation satellite, 1 mm
        ("clock_m", "SV_CLOCK", 1e-3 * 299_792_458, 1e-3),  # 1 ms of satellite clock, 1 mm
        ("q0", "ATT_Q01", 1.0, 2.4e-6),  # 1 arcsec of rotation is 2.4e-6 of quaternion
        ("phase_cyc", "PHASE", 100e6, 1e-3),
    ],
)
def test_resolution_and_range_promised_by_the_design(signal, kind, least, step):
    found = next(s for k in KINDS if k.name == kind for s in k.signals if s.name == signal)
    assert found.factor <= step
    assert found.raw_range[1] * found.factor >= least


def test_what_the_contract_calls_free_is_free():
    """The lists in the module's docstring, with the most receivers."""
    text = contract.__doc__ or ""
    spans = [(int(a, 16), int(b, 16)) for a, b in re.findall(r"(0x[0-9A-F]{3})\.\.(0x[0-9A-F]{3})", text)]
    alone, of_receivers = spans[:-2], spans[-2:]
    free = [i for first, last in alone for i in range(first, last + 1)]
    free += [
        i + 0x10 * r
        for first, last in of_receivers
        for i in range(first, last + 1)
        for r in range(MAX_RECEIVERS)
    ]
    taken = {m.can_id for m in messages(MAX_RECEIVERS)}
    assert sorted({*free, *taken}) == [*range(1, 0x700), *sorted(i for i in taken if i >= 0x700)]
    assert len(free) + len(taken) == len({*free, *taken}), "nothing that is called free is taken"
    nodes = {*range(11, 16), *range(17, 208)}
    assert nodes | {*range(1, MAX_RECEIVERS + 1), *NODES.values()} == {*range(1, 208)}
    assert max(nodes) + contract.HEARTBEAT_BASE == BENCH_FIRST - 1


def kind(name="TILT", base=0x070, sender="ATT", receivers=("FLIGHT",), **more):
    return contract._kind(name, base, sender, receivers, "made up", contract._u("tilt_deg", 16, ""), **more)


@pytest.mark.parametrize(
    "kinds, nodes, line",
    [
        ([kind(base=0x060)], {}, "kinds ATT_Q01 and TILT both have identifier 0x060"),
        ([kind(base=0x173)], {}, "kinds SV_X and TILT both have identifier 0x173"),
        ([kind(base=0x080, sender="RX", per="receiver", stride=1), kind("TURN", 0x087)], {},
         "kinds TILT and TURN both have identifier 0x087"),
        ([kind(base=0x709)], {}, "kinds HEARTBEAT and TILT both have identifier 0x709"),
        ([kind("ATT_Q01")], {}, "kinds at 0x060 and 0x070 both have name ATT_Q01"),
        ([kind()], {"CLINO": 9}, "nodes ATT and CLINO both have number 9"),
        ([kind()], {"CLINO": 3}, "nodes RX3 and CLINO both have number 3"),
        ([kind(sender="CLINO")], {}, "kind TILT: there is no node CLINO"),
        ([kind(sender="RX")], {}, "kind TILT: there is no node RX"),
        ([kind(receivers=("GROUND",))], {}, "kind TILT: there is no node GROUND"),
        ([kind(base=0x7D4)], {}, "kind TILT: identifier 0x7D4 is kept for the bench"),
        ([], {"CLINO": 0xD5}, "kind HEARTBEAT: identifier 0x7D5 is kept for the bench"),
        ([kind(base=0x7DF)], {}, "kind TILT: identifier 0x7DF is one of UDS"),
        ([], {"CLINO": 0xEF}, "kind HEARTBEAT: identifier 0x7EF is one of UDS"),
        ([kind(name="BENCH_X", base=0x7E0)], {}, "kind BENCH_X: identifier 0x7E0 is one of UDS"),
        ([kind(base=0x800)], {}, "kind TILT: identifier 0x800 is none of 11 bits"),
    ],
)  # fmt: skip
def test_what_is_taken_twice_is_refused(kinds, nodes, line):
    with pytest.raises(ValueError) as caught:
        check((*KINDS, *kinds), {**NODES, **nodes})
    assert str(caught.value) == line


def test_a_free_identifier_and_node_are_taken():
    check((*KINDS, kind(sender="CLINO")), {**NODES, "CLINO": 11})


def test_the_table_is_checked_when_it_is_read():
    """A message added twice ends the import: nobody has to remember to ask."""
    source = Path(contract.__file__).read_text("utf-8")
    twice = source.replace("\nKIND_BY_NAME", "\nKINDS = (*KINDS, replace(KINDS[0]))\nKIND_BY_NAME", 1)
    with pytest.raises(ValueError, match="TIME_MARK"):
        exec(twice, {"__name__": contract.__name__, "replace": replace})
