"""Options of the channel manager."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict


class ChannelOptions(Strict):
    resend_epochs: Annotated[
        int, Field(ge=1, le=60, description="a command unanswered for so long is repeated")
    ] = 2
    backoff_epochs: Annotated[
        int, Field(ge=1, le=3600, description="a satellite a receiver refused is left alone for so long")
    ] = 30
    second_signal_backoff_epochs: Annotated[
        int,
        Field(
            ge=1, le=86400, description="a second signal a receiver does not have is left alone for so long"
        ),
    ] = 3600
