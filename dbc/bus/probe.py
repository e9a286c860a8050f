"""Bus probe: do other nodes already send on a bus that others may use?"""

from __future__ import annotations

import time
from collections.abc import Collection

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK

LISTEN_S = 0.3


def senders_heard(link: Link, codec: Codec, senders: Collection[str], listen_s: float = LISTEN_S) -> set[str]:
    """Those of the contract's `senders` that were heard within `listen_s`."""
    heard: set[str] = set()
    end_s = time.monotonic() + listen_s
    while (rest_s := end_s - time.monotonic()) > 0:
        frames = link.receive(rest_s)
        base = frames.can_id[frames.can_id <= SFF_MASK]
        heard.update(codec.sender_of[i] for i in set(base.tolist()))
    return heard & set(senders)
