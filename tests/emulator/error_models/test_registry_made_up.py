"""What a new error model takes: a file with its row, and the registry. Scenario keys, stages and bus
follow."""

import json
import subprocess
import sys

import numpy as np
import pytest


@pytest.fixture(scope="module")
def shown():
    command = [sys.executable, "-m", "tests.support.made_up_models"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_term_on_the_path_reaches_the_receiver_it_is_of(shown):
    assert shown["longer"]["longer_m"] == [[[5.0]] * 3, [[0.0]] * 3]


def test_a_model_of_the_oscillator_takes_the_place_of_the_bounded_wander(shown):
    assert shown["plain"]["clock_s"] == 0.0
    assert shown["fast"]["clock_s"] == 1e-6
    longer_m = np.concatenate([np.ravel(part) for part in shown["fast"]["longer_m"]])
    assert longer_m == pytest.approx(299.792458, abs=2e-3)


def test_a_model_stepped_with_the_receivers_remembers(shown):
    assert shown["creeping"]["longer_m"] == [[[1.0], [2.0], [3.0]]] * 2


def test_a_stepped_model_disturbs_rates_and_carriers_too(shown):
    """A metre is c / f of a wave; carriers on the bus lack whole waves."""
    assert shown["creeping"]["faster_mps"] == [1.0]
    hz = [
        1575.42e6 if number is None else 1602e6 + 562.5e3 * number
        for number in shown["creeping"]["frequency"]
    ]
    metres = np.array([[1.0], [2.0], [3.0]])
    off = np.array(shown["creeping"]["more_cyc"]) - metres * np.array(hz) / 299_792_458
    assert np.abs(off - np.rint(off)).max() < 3e-3


def test_terms_of_stages_add(shown):
    assert shown["twice"]["longer_m"] == [[[3.5], [4.5], [5.5]], [[1.0], [2.0], [3.0]]]


def test_levels_of_measurements_and_of_paths_that_do_not_lead_are_measured(shown):
    assert shown["weak"]["stronger_db"] == [-6.0]
    assert shown["muffled"]["stronger_db"] == [-3.0]
    assert shown["longer"]["stronger_db"] == [0.0]


def test_a_channel_with_a_value_that_the_bus_cannot_carry_is_left_out_and_not_counted(shown):
    first, *others = shown["measured"]["plain"]
    assert first > 0
    assert shown["measured"]["wild"] == [0, *others]
    assert shown["counted"]["plain"] == [first, *others]
    assert shown["counted"]["wild"] == [0, *others]


def test_a_model_of_the_bus_has_the_last_word(shown):
    assert shown["plain"]["heartbeats"] == 6
    assert shown["silent"]["heartbeats"] == 0
