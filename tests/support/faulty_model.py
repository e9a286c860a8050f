"""`gnss-hil` with an error model that fails, as somebody's new file would hold it.

`python -m tests.support.faulty_model CASE ARGUMENTS` registers the model of that name as `faulty`, on where a
scenario does not say otherwise, and runs the command.
"""

from __future__ import annotations

import sys

import numpy as np

from gnss_hil.emulator.error_models import registry
from gnss_hil.emulator.error_models.base import ObservableTerm, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor


class Unbounded(PathModel):
    """Pseudoranges that are no numbers."""

    def block(self, at):
        return PathTerm(range_m=np.full(len(at), np.nan))


class Lost:
    """A clock of the computer that is nowhere."""

    def block(self, epochs):
        return np.full(epochs.count, np.nan)


class Breaking:
    """Raises in the fourth epoch."""

    def step(self, state, at, epoch):
        return state, ObservableTerm(range_m=1 / (3 - epoch))


CASES = {
    "unbounded": (Stage.PATH, Unbounded),
    "lost": (Stage.LATCH, Lost),
    "breaking": (Stage.OBSERVABLE, Breaking),
}


def main() -> int:
    stage, model = CASES[sys.argv[1]]
    registry.FACTORS["faulty"] = Row(
        "faulty", Factor, stage, "made up", lambda params, context: model(), default=True
    )
    from gnss_hil.tools.command_line.main import main as command

    return command(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
