"""What `gnss-hil inject` refuses, and what it says of faults that act."""

from __future__ import annotations

import pytest

from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.engine import Event
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.gateway.session import Acting
from tests.support.faulted import plan_of

pytestmark = pytest.mark.verifies(
    "tools/gateway/session.py",
    what="What a gateway refuses and says",
    by="mistakes, each with its line; hand-made events",
    status="validated",
)

BUSES = ("--from", "embedded:/nowhere/a", "--to", "embedded:/nowhere/b")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--to", "embedded:/b"), "--from: none given; --from embedded:PATH, or INTERFACE:CHANNEL"),
        (("--from", "embedded:/b"), "--to: none given"),
        (
            ("--from", "embedded:/b", "--to", "embedded:/b"),
            "the same bus as --from; a gateway is",
        ),
        (("--from", "inline", "--to", "embedded:/b"), "another process has to be able to join it"),
        (("rx7 off", *BUSES), "'rx7 off': receiver-off: "),
        (("jammer @30+5", *BUSES), "'jammer @30+5': jammer: gateway cannot do it: "),
        (("repley", *BUSES), "replay"),
        (("rx2 of", "rx2 silenc", *BUSES), "rx2 silenc"),
        (("--vehicle", "soyus-ms", *BUSES), "soyuz-ms"),
    ],
)
def test_a_mistake_is_told_before_a_bus_is_joined(capsys, words, told):
    assert main(["inject", *words]) == 2
    assert told in capsys.readouterr().err


def test_a_bus_that_cannot_be_is_the_environments_fault(capsys):
    assert main(["inject", *BUSES]) == 3
    assert "embedded:/nowhere/a" in capsys.readouterr().err


def test_it_says_when_a_fault_begins_and_when_it_is_over():
    said: list[str] = []
    acting = Acting(plan_of("rx2 off", "ATT silence name=quiet"), said.append)

    def event(fault: int, epoch: int, touched: int, since: int = 3) -> Event:
        return Event(fault, epoch, 0, Direction.FLIGHT, since, touched, clipped=fault)

    acting.look((event(0, 3, 10),))
    acting.look((event(0, 4, 11), event(1, 4, 2)))
    acting.look((event(0, 5, 1, since=-1), event(1, 5, 2)))
    acting.look((event(1, 6, 2),))
    acting.look(())
    acting.end()
    assert said == [
        "epoch 3: receiver-off 1 (rx2) acts",
        "epoch 4: quiet (ATT) acts",
        "epoch 4: receiver-off 1 (rx2) acted for the last time, 21 frames touched",
        "epoch 6: quiet (ATT) acted for the last time, 6 frames touched; 3 values led out of what the "
        "signal can carry",
    ]
