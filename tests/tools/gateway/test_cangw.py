"""Rules of the kernel's gateway: what is refused by name, and what the rules do, played by a second reader.

`tests/system/test_cangw_inside.py` has a kernel judge them.
"""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.gateway.cangw import covering

pytestmark = pytest.mark.verifies(
    "tools/gateway/cangw.py",
    what="Faults as rules of the kernel",
    by="what cannot be done, by name; covers of drawn sets of identifiers",
    status="validated",
)

BUSES = ("--as-cangw", "--from", "socketcan:vcan0", "--to", "socketcan:vcan1")


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("rx2 delay 1", "delay: cangw cannot do it"),
        ("rx2 repetition", "repetition: cangw cannot do it"),
        ("insertion identifier=0x3A5", "insertion: cangw cannot do it"),
        ("rx2 loss @30+10", "loss: at: cangw knows no time"),
        ("rx2 loss p=0.5", "loss: at: cangw knows no time, no number and no chance"),
        ("rx2 loss n=3", "loss: at: cangw knows no time"),
        ("rx2 loss after first fix", "loss: at: cangw knows no time"),
        ("rx2 ch3 loss", "loss: on.channel: cangw tells frames by identifier alone"),
        ("G12 loss", "loss: on.satellite: cangw tells"),
        ("glonass loss", "loss: on.system: cangw tells"),
        ("rx2 RANGE corruption 2", "corruption: 0x110: the bits change in each frame in its own way"),
        ("rx2 RANGE.pseudorange_m += 30", "masquerade: 0x110: the bits change in each frame in its own way"),
        ("rx2 RANGE crc random", "crc: 0x110: CRCs that are neither valid nor off by the same bits"),
    ],
)
def test_what_the_kernel_cannot_do_is_refused_by_name(capsys, fault, told):
    assert main(["inject", fault, *BUSES]) == 2
    said = capsys.readouterr()
    assert told in said.err and not said.out


def test_every_fault_that_cannot_be_is_named(capsys):
    assert main(["inject", "rx2 loss @30+10", "rx1 ch2 loss", "rx3 loss", *BUSES]) == 2
    assert capsys.readouterr().err.count("cangw") == 2


TOLD = {
    "rx2 delay 1": 1,
    "rx2 loss @30+5": 1,
    "rx1 ch2 loss p=0.1": 2,
    "G12 loss": 1,
    "rx1 RANGE.pseudorange_m += 3": 1,
    "rx9 loss": 1,
    "rx1 crc random": 1,
    "rx1 lsos": 1,
    "rx1 RANGE loss": 0,
}


def test_all_that_cannot_be_of_all_faults_is_named_in_one_go(capsys):
    assert main(["inject", *TOLD, *BUSES]) == 2
    told = capsys.readouterr().err.splitlines()
    assert {one: sum(f"'{one}'" in line for line in told) for one in TOLD} == TOLD


def test_what_the_kernel_can_do_alone_and_not_together_is_refused(capsys):
    together = ["rx1 RANGE.pseudorange_m = 5", "rx1 RANGE length 4"]
    assert [main(["inject", one, *BUSES]) for one in together] == [0, 0]
    capsys.readouterr()
    assert main(["inject", *together, *BUSES]) == 2
    assert "together: 0x100: CRCs that are neither valid" in capsys.readouterr().err


def test_it_is_between_interfaces_of_the_kernel(capsys):
    words = ["inject", "rx2 loss", "--as-cangw", "--from", "embedded:/tmp/a", "--to", "socketcan:vcan1"]
    assert main(words) == 2
    assert "--from embedded:/tmp/a: cangw is between interfaces of the kernel" in capsys.readouterr().err


@pytest.mark.parametrize("seed", range(20))
def test_every_wanted_identifier_is_matched_once_and_no_other(seed):
    draw = np.random.default_rng(seed)
    wanted = draw.random(2048) < draw.random()
    wanted[: draw.integers(0, 1000)] = True
    matched = np.zeros(2048, int)
    for value, mask in covering(wanted):
        matched += (np.arange(2048) & mask) == value & mask
    assert (matched == wanted).all()


def test_all_identifiers_are_one_rule():
    assert [*covering(np.ones(2048, bool))] == [(0, 0)]
    assert [*covering(np.zeros(2048, bool))] == []


def test_identifiers_that_a_change_does_not_touch_are_no_rules_of_their_own(capsys):
    assert main(["inject", "RANGE.pseudorange_m = 22000000", *BUSES]) == 0
    rules = [line for line in capsys.readouterr().out.splitlines() if " -s vcan0 " in line]
    assert [line.split(" -f ")[1][:3] for line in rules if " -m " in line] == ["100", "110", "120", "130"]
    assert len(rules) < 50
