"""Error models that are nowhere but here, as somebody's new file would hold them: what a run shows of each.

`python -m tests.support.made_up_models` registers them before any scenario is read, plays a soyuz without and
with each of them, and prints as JSON what the bus and the truth show.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from gnss_hil.emulator.error_models import registry
from gnss_hil.emulator.error_models.base import ObservableTerm, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor


class Metres(Factor):
    """metres  by how much."""

    metres: float = 5.0


@dataclass(frozen=True)
class Longer(PathModel):
    """Pseudoranges of the first receiver are longer."""

    params: Metres

    def block(self, at):
        return PathTerm(range_m=np.where(at.receiver == 0, self.params.metres, 0.0))


class Fast:
    """All receiver clocks are a microsecond fast."""

    def block(self, epochs):
        clocks = np.zeros((epochs.count, 2, 8))
        clocks[:, 0] = 1e-6
        return clocks


class Creeping:
    """Pseudoranges and carriers that grow by a metre with every epoch in which anything is measured, and
    rates that say so: a model that remembers."""

    def step(self, state, at, epoch):
        count = (state or 0) + (len(at.sat) > 0)
        return count, ObservableTerm(range_m=float(count), phase_m=float(count), rate_mps=1.0)


class Wild:
    """Pseudoranges of the first receiver that no frame can carry."""

    def step(self, state, at, epoch):
        return state, ObservableTerm(range_m=np.where(at.receiver == 0, 1e9, 0.0))


class Weak:
    """6 dB less is measured, by a term on measurements."""

    def step(self, state, at, epoch):
        return state, ObservableTerm(level_db=-6.0)


class Muffled(PathModel):
    """3 dB less is measured, by a term on the path of a model that does not lead."""

    def block(self, at):
        return PathTerm(level_db=-3.0)


class Silent:
    """Heartbeats are never sent."""

    def step(self, state, block, epoch):
        return state, block[block.can_id < 0x700]


MODELS = {
    "longer": Row("longer", Metres, Stage.PATH, "made up", lambda params, context: Longer(params)),
    "fast": Row("fast", Factor, Stage.OSCILLATOR, "made up", lambda params, context: Fast()),
    "creeping": Row("creeping", Factor, Stage.OBSERVABLE, "made up", lambda params, context: Creeping()),
    "wild": Row("wild", Factor, Stage.OBSERVABLE, "made up", lambda params, context: Wild()),
    "weak": Row("weak", Factor, Stage.OBSERVABLE, "made up", lambda params, context: Weak()),
    "muffled": Row("muffled", Factor, Stage.PATH, "made up", lambda params, context: Muffled()),
    "silent": Row("silent", Factor, Stage.FRAMES, "made up", lambda params, context: Silent()),
}


def main() -> None:
    registry.FACTORS.update(MODELS)
    from tests.support import emulated  # reads the registry

    def played(**factors):
        quiet = emulated.craft(receivers=emulated.QUICK, factors={**emulated.QUIET, **factors})
        still = quiet | {"clock": {"amplitude_ms": 0.0}}
        _, blocks, truths = emulated.run(emulated.world(still), 3)
        seen = [emulated.channels(block) for block in blocks]
        return {
            "range_m": np.array([s["pseudorange_m"] for s in seen]),
            "rate_mps": np.array([s["range_rate_mps"] for s in seen]),
            "phase_cyc": np.array([s["phase_cyc"] for s in seen]),
            "frequency": np.where(seen[0]["sat_system"] == 0, None, seen[0]["frequency"]),
            "receiver": seen[0]["receiver"],
            "cn0_dbhz": np.array([s["cn0_dbhz"] for s in seen]),
            "counted": emulated.decode(blocks[-1], "STATUS")["channels_tracking"].tolist(),
            "clock_s": float(truths[-1]["clock_s"][0]),
            "heartbeats": len(emulated.decode(blocks[-1], "HEARTBEAT")["receiver"]),
        }

    plain = played()
    found = {name: played(**{name: True}) for name in MODELS}
    wild = found.pop("wild")
    found["twice"] = played(longer={"metres": 2.5}, creeping=True)
    print(
        json.dumps(
            {
                name: {
                    "longer_m": [
                        np.unique(np.round((run["range_m"] - plain["range_m"])[:, rows], 3), axis=1).tolist()
                        for rows in (plain["receiver"] == 1, plain["receiver"] > 1)
                    ],
                    "faster_mps": np.unique(np.round(run["rate_mps"] - plain["rate_mps"], 3)).tolist(),
                    "more_cyc": (run["phase_cyc"] - plain["phase_cyc"]).tolist(),
                    "frequency": run["frequency"].tolist(),
                    "clock_s": run["clock_s"],
                    "heartbeats": run["heartbeats"],
                    "stronger_db": np.unique(run["cn0_dbhz"] - plain["cn0_dbhz"]).tolist(),
                }
                for name, run in {"plain": plain, **found}.items()
            }
            | {
                "counted": {name: run["counted"] for name, run in {"plain": plain, "wild": wild}.items()},
                "measured": {
                    name: np.bincount(run["receiver"], minlength=5)[1:].tolist()
                    for name, run in {"plain": plain, "wild": wild}.items()
                },
            }
        )
    )


if __name__ == "__main__":
    main()
