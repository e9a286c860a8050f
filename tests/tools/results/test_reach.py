"""Where faults can be seen: places of faults against places of checks."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.faults.files import of_line
from gnss_hil.tools.results.detectors import Sign
from gnss_hil.tools.results.reach import reach

pytestmark = pytest.mark.verifies(
    "tools/results/reach.py",
    what="Faults: which checks are of their places",
    by="places told by hand; the library, flown",
    status="validated",
)

ANTENNAS = ("fore", "starboard", "aft", "port")


def of(fault: str, word: str, where: str) -> bool:
    return reach(of_line(fault), ANTENNAS).has(Sign(word, where, np.array([1])))


@pytest.mark.parametrize(
    ("fault", "word", "where", "seen"),
    [
        ("rx1 RANGE crc wrong", "corrupted", "RX1_RANGE", True),
        ("rx1 RANGE crc wrong", "corrupted", "RX1_RATE", False),
        ("rx1 RANGE crc wrong", "corrupted", "RX2_RANGE", False),
        ("rx1 RANGE crc wrong", "timeout", "RX1_STATUS", True),
        ("rx1 RANGE crc wrong", "silence", "RX1", True),
        ("rx1 RANGE crc wrong", "silence", "RX2", False),
        ("aft off", "silence", "RX3", True),
        ("aft off", "restart", "RX1", False),
        ("aft off", "mark", "TIME", False),
        ("rx4 range +30 m", "receiver", "RX4", True),
        ("rx4 range +30 m", "receiver", "RX1", False),
        ("rx4 range +30 m", "exclusion", "G07", True),
        ("G07 range +30 m", "exclusion", "G07", True),
        ("G07 range +30 m", "exclusion", "G08", False),
        ("G07 range +30 m", "silence", "ATT", False),
        ("glonass constellation-bias 50", "exclusion", "R03", True),
        ("glonass constellation-bias 50", "exclusion", "G03", False),
        ("rx3 ch1 loss", "lost", "RX3_RANGE", True),
        ("rx3 ch1 loss", "lost", "RX3_STATUS", False),
        ("ATT silence", "attitude", "FLIGHT", True),
        ("ATT silence", "silence", "ATT", True),
        ("ATT silence", "lost", "RX1_RANGE", False),
        ("rx1 RANGE wrong-address 272", "corrupted", "RX2_RANGE", True),
        ("rx1 RANGE wrong-address 272", "corrupted", "RX3_RANGE", False),
        ("rx2 delay 1", "unknown-id", "0x3A5", False),
        ("rx1 RANGE wrong-address 0x3A5", "unknown-id", "0x3A5", True),
        ("0x3A0&0x7F0 loss", "unknown-id", "0x3A5", True),
        ("0x3A0&0x7F0 loss", "unknown-id", "0x3B5", False),
        ("babbling 2000", "unknown-id", "0x001", True),
        ("command-lost", "no-answer", "RX3", True),
        ("rx1 command-lost", "no-answer", "RX3", False),
        ("mark-late", "mixed-epoch", "RX4_RANGE", True),
        ("all loss", "lost", "ATT_Q01", True),
    ],
)
def test_a_check_is_of_a_fault_s_place_or_not(fault, word, where, seen):
    assert of(f"{fault} @10+5", word, where) is seen
