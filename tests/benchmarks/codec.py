"""Codec against cantools in the same run, batches of 240: `python tests/benchmarks/codec.py`."""

from __future__ import annotations

import statistics
import time

import numpy as np
from cantools.database import load_string

from gnss_hil.dbc.contract.codec import codec

BATCH = 240
ROUNDS = 15


def seconds(work, repeat: int) -> float:
    """Median seconds of one call over ROUNDS rounds."""
    rounds = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        for _ in range(repeat):
            work()
        rounds.append((time.perf_counter() - start) / repeat)
    return statistics.median(rounds)


def samples(layout, rng) -> dict[str, np.ndarray]:
    """Physical values over each signal's whole range, BATCH of them."""
    bounds = zip(layout.raw_min.astype(int), layout.raw_max.astype(int), strict=True)
    raw = [rng.integers(low, high, BATCH, endpoint=True) for low, high in bounds]
    return {name: r * f for name, r, f in zip(layout.signals, raw, layout.factor, strict=True)}


def measure(ours, message, kind: str, rng) -> tuple[float, ...]:
    """Seconds a batch: our decode, cantools decode, our encode, cantools encode."""
    values = samples(ours.kinds[kind], rng)
    data = ours.encode(kind, values)
    frames = [bytes(row) for row in data]
    rows = [{name: float(v[i]) for name, v in values.items()} for i in range(BATCH)]
    return (
        seconds(lambda: ours.decode(kind, data), 200),
        seconds(lambda: [message.decode(f, decode_choices=False) for f in frames], 2),
        seconds(lambda: ours.encode(kind, values), 200),
        seconds(lambda: [message.encode(r) for r in rows], 2),
    )


def main() -> None:
    ours = codec(4)
    theirs = load_string(ours.text, "dbc")
    rng = np.random.default_rng(7)
    print("million frames/s    decode  cantools  ratio    encode  cantools  ratio")
    ratios = []
    for kind in ("RANGE", "RATE", "PHASE", "SV_X", "SV_VX", "SV_CLOCK"):
        d, dc, e, ec = measure(ours, theirs.get_message_by_name(f"RX1_{kind}"), kind, rng)
        ratios.append((dc / d, ec / e))
        rate = [BATCH / s / 1e6 for s in (d, dc, e, ec)]
        print(
            f"{kind:<16}{rate[0]:>10.2f}{rate[1]:>10.3f}{dc / d:>7.1f}"
            f"{rate[2]:>10.2f}{rate[3]:>10.3f}{ec / e:>7.1f}"
        )
    decode, encode = np.median(ratios, axis=0)
    print(f"median: decoding {decode:.1f} times cantools, encoding {encode:.1f} times")


if __name__ == "__main__":
    main()
