"""How long an ephemeris takes to be collected: by the frames of the messages, in place of one fixed time."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.error_models.base import Context, ErrorModel, Row, Stage, TrackingTerm
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.data_frames import collection_ns


class DataCollection(Factor):
    """How long an ephemeris takes to be collected, by the frames of the messages, in place of one fixed time.

    shared  the receivers of a craft tell each other what they have collected
    """

    shared: bool = True


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    shared: bool

    def tracking(self, at: ChannelGeometry | None) -> TrackingTerm:
        return TrackingTerm(collection_ns=collection_ns, shared=self.shared)


def build(params: DataCollection, context: Context) -> ErrorModel:
    return Model(params.shared)


ROW = Row(
    "data_collection",
    DataCollection,
    Stage.TRACKING,
    "IS-GPS-200, 20.3.2; GLONASS ICD 5.1, 4.3",
    build,
    shows="STATUS",
)
