"""How terms of several models join, worked out by hand."""

import numpy as np
import pytest

from gnss_hil.emulator.environment import models as joined
from gnss_hil.emulator.error_models.base import AttitudeTerm, Epochs, PathTerm, Stage

pytestmark = pytest.mark.verifies(
    "emulator/environment/models.py",
    what="Joining of error models' terms",
    by="models of the test's own, joined by hand",
    status="modelled",
)

EPOCHS = Epochs(0, 2, 0, 1)


class Told:
    """A model that says what it is told to, whatever it is asked for."""

    leads = reaches = False

    def __init__(self, term):
        self._term = term

    def block(self, at):
        return self._term


def test_terms_of_the_path_add_part_by_part():
    one = PathTerm(1.0, 2.0, 3.0, np.array([0.1]), -1.0)
    other = PathTerm(10.0, 20.0, 30.0, np.array([0.2]), -2.0)
    models = joined.path_models({Stage.PATH: (Told(one), Told(other), Told(PathTerm()))})
    found = models.followed(None)
    assert (found.range_m, found.phase_m, found.rate_mps, found.level_db) == (11.0, 22.0, 33.0, -3.0)
    assert found.turns_cyc == pytest.approx([0.3])


def test_clocks_of_the_computer_add():
    models = {Stage.LATCH: (Told(np.array([1e-6, 2e-6])), Told(np.array([5e-6, 5e-6])))}
    assert joined.ahead_s(models, EPOCHS) == pytest.approx([6e-6, 7e-6])
    assert joined.ahead_s({}, EPOCHS).tolist() == [0.0, 0.0]


def test_small_angles_and_rates_add():
    terms = [AttitudeTerm(np.full((2, 3), a), np.full((2, 3), b)) for a, b in ((1e-3, 1e-5), (2e-3, 4e-5))]
    found = joined.attitude({Stage.ATTITUDE: tuple(map(Told, terms))}, EPOCHS)
    assert found is not None
    assert found.angle_rad == pytest.approx(np.full((2, 3), 3e-3))
    assert found.rate_rps == pytest.approx(np.full((2, 3), 5e-5))
    assert joined.attitude({}, EPOCHS) is None
