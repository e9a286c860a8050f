"""Parameters of the ionosphere; formulas and presets stand in `emulator.signal.ionosphere`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gnss_hil.emulator.error_models.params import Factor

Four = tuple[float, float, float, float]
Share = Annotated[float, Field(ge=0, lt=1)]


class Ionosphere(Factor):
    """Electrons around the Earth, one sky for all craft.

    model         where the vertical content comes from: the coefficients GPS broadcasts, or measured maps
    activity      of the Sun: coefficients and profile wherever nothing else is given
    alpha, beta   coefficients of one's own, as broadcast [s, semicircles]
    files         "ionex": maps that together cover the run; "klobuchar": one navigation file whose header
                  has the coefficients
    the others    heights and scales of the profile, in place of the preset's
    """

    model: Literal["klobuchar", "ionex"] = "klobuchar"
    activity: Literal["low", "high"] = "low"
    alpha: Four | None = None
    beta: Four | None = None
    files: tuple[str, ...] = ()
    peak_height_km: Annotated[float, Field(ge=150, le=600)] | None = None
    bottomside_scale_km: Annotated[float, Field(ge=10, le=150)] | None = None
    topside_scale_km: Annotated[float, Field(ge=20, le=300)] | None = None
    plasmasphere_scale_km: Annotated[float, Field(ge=500, le=20_000)] | None = None
    plasmasphere_share: Share | None = None

    @model_validator(mode="after")
    def _sources(self):
        if (self.alpha is None) != (self.beta is None):
            raise ValueError("alpha and beta belong together")
        if self.model == "ionex" and (not self.files or self.alpha):
            raise ValueError("model 'ionex' takes its content from files alone: name one or more")
        if self.model == "klobuchar" and len(self.files) > (0 if self.alpha else 1):
            raise ValueError("model 'klobuchar' takes alpha and beta, or one navigation file")
        return self
