"""Names of what a flight software may see of a fault: the words of `detected_by`.

They are of the bench, not of one flight software: a report tells by which of them a fault was seen, from what
the software puts on the bus.
"""

from __future__ import annotations

from collections.abc import Mapping

CHECKS: Mapping[str, str] = {
    "lost": "a counter says that frames are missing",
    "repeated": "a frame came again",
    "wrong-sequence": "a counter that does not follow",
    "corrupted": "a CRC that does not fit",
    "mixed-epoch": "a frame of another epoch",
    "unknown-id": "an identifier that is not of the contract",
    "wrong-length": "a frame of another length",
    "timeout": "a stream that should come and does not",
    "silence": "a node whose heartbeat is missing",
    "restart": "a heartbeat with another boot count",
    "mark": "a time mark that is missing, goes back or jumps",
    "bench": "a bench frame that is not believed",
    "no-answer": "a command without an answer, or with that to another",
    "attitude": "an attitude that is none, or does not fit the one before",
    "satellite": "a satellite where none can be, or not where it was predicted",
    "health": "a satellite that says it is unhealthy",
    "range": "a range that no orbit allows",
    "innovation": "a measurement that does not fit the state carried on",
    "exclusion": "a measurement that does not fit the others",
    "receiver": "a receiver that does not fit the others",
    "none": "nothing on the bus or in the measurements tells",
}
