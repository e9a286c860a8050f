"""Sensors that fail: one line with sensor, message and signal, never a node that is silent."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.emulator.error_models.checked import ModelError
from gnss_hil.emulator.sensors import attitude
from gnss_hil.emulator.sensors.base import Reading
from gnss_hil.emulator.sensors.frames import node, nodes
from gnss_hil.emulator.sensors.params import SensorParams
from gnss_hil.emulator.sensors.registry import SENSORS

pytestmark = pytest.mark.verifies(what="Sensor nodes as rows")

CODEC = codec(4)
SAID = r"^sensor 'attitude' \(node ATT, craft soyuz\): "
BLOCK = SimpleNamespace(geometry=range(3))
EVERY = np.arange(3)
LEVEL = {"q0": np.ones(3), "q1": 0, "q2": 0.0, "q3": 0.0, "wx_rps": 0.0, "wy_rps": 0.0, "wz_rps": 0.0}


class Told:
    """A sensor that answers what it is told to; an exception it raises."""

    def __init__(self, answer):
        self._answer = answer

    def over(self, block):
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer


def sent(answer):
    return node(CODEC, attitude.ROW, Told(answer), "craft soyuz").over(BLOCK)  # pyright: ignore[reportArgumentType]


def test_a_right_reading_is_sent():
    assert sent(Reading(EVERY, LEVEL)).starts.tolist() == [0, 3, 6, 9]
    assert sent(Reading(np.zeros(0, int), {**LEVEL, "q0": 1.0})).starts.tolist() == [0, 0, 0, 0]
    edge = sent(Reading(EVERY, {**LEVEL, "wx_rps": 0.131068, "wy_rps": -0.131072}))
    assert edge.every.fits.all()


@pytest.mark.parametrize(
    "answer, fault",
    [
        (KeyError("tilt"), "KeyError: 'tilt'"),
        ((EVERY, LEVEL), "answers tuple; asked for is Reading"),
        (Reading(EVERY, {k: v for k, v in LEVEL.items() if k != "q2"}), "ATT_Q23.q2 has no value"),
        (Reading(EVERY, {**LEVEL, "tilt": 1.0}), "none of ATT_Q01, ATT_Q23, ATT_RATE has a signal tilt"),
        (Reading(EVERY, {**LEVEL, "q1": np.zeros(2)}), r"ATT_Q01.q1 has shape \(2,\); there are 3 records"),
        (Reading(EVERY, {**LEVEL, "q1": "level"}), "ATT_Q01.q1 is not of numbers"),
        (Reading(EVERY, {**LEVEL, "q1": np.array([0, np.nan, 0])}), "ATT_Q01.q1 is nan; the bus carries "),
        (Reading(EVERY, {**LEVEL, "wy_rps": -0.2}),
         "ATT_RATE.wy_rps is -0.2; the bus carries -0.131072 to 0.131068 rad/s$"),
        (Reading(np.arange(1, 4), LEVEL), "its epochs do not ascend within the block's, 0 to 2"),
        (Reading(EVERY - 1, LEVEL), "its epochs do not ascend"),
        (Reading(EVERY[[0, 2, 1]], LEVEL), "its epochs do not ascend"),
        (Reading(np.arange(3.0), LEVEL), r"its epochs are no array \(r,\) of whole numbers"),  # pyright: ignore[reportArgumentType]
    ],
)  # fmt: skip
def test_a_wrong_reading_is_one_line(answer, fault):
    with pytest.raises(ModelError, match=SAID + fault):
        sent(answer)


@pytest.mark.parametrize(
    "row, fault",
    [
        (replace(attitude.ROW, node="CLINO"), "the contract has no node CLINO; it has ATT, TIME, FLIGHT"),
        (replace(attitude.ROW, kinds=("ATT_Q01", "TILT")), "the contract has no message TILT"),
        (replace(attitude.ROW, kinds=("TIME_MARK",)), "TIME_MARK is a message of TIME"),
        (replace(attitude.ROW, kinds=("RANGE",)), "RANGE is a message of RX"),
    ],
)
def test_a_row_without_its_contract_is_refused(row, fault):
    with pytest.raises(ModelError, match=rf"^sensor 'attitude' \(node {row.node}, craft soyuz\): {fault}$"):
        node(CODEC, row, attitude.Sensor(), "craft soyuz")


def test_what_cannot_be_built_and_a_node_of_two_have_their_names(monkeypatch):
    def build(params, context):
        return {}["axis"]

    monkeypatch.setitem(SENSORS, "gyro", replace(attitude.ROW, name="gyro"))
    both = {"attitude": SensorParams(), "gyro": SensorParams()}
    line = r"^sensor 'gyro' \(node ATT, craft soyuz\): the node is that of sensor 'attitude' "
    with pytest.raises(ModelError, match=line):
        nodes(CODEC, both, None, "craft soyuz")  # pyright: ignore[reportArgumentType]
    monkeypatch.setitem(SENSORS, "gyro", replace(attitude.ROW, name="gyro", build=build))
    with pytest.raises(ModelError, match=r"^sensor 'gyro' \(craft soyuz\): KeyError: 'axis'$"):
        nodes(CODEC, both, None, "craft soyuz")  # pyright: ignore[reportArgumentType]
