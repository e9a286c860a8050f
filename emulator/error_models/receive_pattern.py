"""The craft's antennas."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.emulator.error_models.base import CraftContext, Fixed, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal import antenna_patterns, link_budget


class ReceivePattern(Factor):
    """The craft's antennas.

    pattern                    "law" (through gain_dbi and gain_at_90deg_dbi), a shipped name, or a file
    column                     gain column of a file that has several
    gain_dbi                   of the law, along the boresight
    gain_at_90deg_dbi          of the law, at right angles; linear in the cosine between
    antennas                   antenna name -> pattern, where it differs
    floor_dbi                  gain at 180 deg of a table that ends before: a straight line leads there from
                               its last angle; without it nothing is received behind that
    How weakly left-handed waves are received belongs to reflections: `Multipath.cross_polar_db`.
    """

    pattern: str = "law"
    column: str = ""
    gain_dbi: Annotated[float, Field(ge=-20, le=30)] = 4.0
    gain_at_90deg_dbi: Annotated[float, Field(ge=-60, le=30)] = -6.0
    antennas: dict[str, str] = Field(default_factory=dict)
    floor_dbi: Annotated[float, Field(ge=-120, le=30)] | None = None


def antennas_of(params: ReceivePattern, names: tuple[str, ...]) -> antenna_patterns.Receive:
    """Antennas of these names (m,). ValueError if the parameters name another, FileError if a table is
    bad."""
    unknown = sorted(set(params.antennas) - set(names))
    if unknown:
        raise ValueError(f"antenna '{unknown[0]}' is not there; there are {', '.join(names)}")
    wanted = [params.antennas.get(name, params.pattern) for name in names]
    law_dbi = params.gain_dbi, params.gain_at_90deg_dbi
    found = {name: link_budget.pattern_of(name, params.column, law_dbi) for name in wanted}
    return antenna_patterns.receive(tuple(found[name] for name in wanted), params.floor_dbi)


def build(params: ReceivePattern, context: CraftContext) -> Fixed[LinkTerm]:
    return Fixed(LinkTerm(antennas=antennas_of(params, context.vehicle.names)))


ROW = Row(
    "receive_pattern",
    ReceivePattern,
    Stage.LINK,
    "tables by angle, shipped or of a file",
    build,
    shows="RATE",
)
