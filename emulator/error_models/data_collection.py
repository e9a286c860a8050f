"""How long an ephemeris takes to be collected: by the frames of the messages, in place of one fixed time."""

from __future__ import annotations

from gnss_hil.dbc.common import systems
from gnss_hil.emulator.error_models.base import Context, Fixed, Row, Stage, TrackingTerm, require_systems
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.data_frames import FRAMES, collection_ns


class DataCollection(Factor):
    """How long an ephemeris takes to be collected, by the frames of the messages, in place of one fixed time.

    shared  the receivers of a craft share with each other what they have collected
    """

    shared: bool = True


def build(params: DataCollection, context: Context) -> Fixed[TrackingTerm]:
    known = [row.value for row in systems.tracked() if row.name in FRAMES]
    require_systems(context, known, "frames of messages")
    return Fixed(TrackingTerm(collection_ns=collection_ns, shared=params.shared))


ROW = Row(
    "data_collection",
    DataCollection,
    Stage.TRACKING,
    "IS-GPS-200, 20.3.2; GLONASS ICD 5.1, 4.3",
    build,
    shows="STATUS",
)
