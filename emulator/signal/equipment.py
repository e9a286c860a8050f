"""From a scenario's words to the link budget's tables: satellites' blocks, antennas, front end, jammers."""

from __future__ import annotations

from datetime import date

import numpy as np

from gnss_hil.emulator.constellation import blocks
from gnss_hil.emulator.error_models.params_link import (
    Jamming,
    LinkBudget,
    ReceivePattern,
    TransmitPattern,
)
from gnss_hil.emulator.signal import antenna_patterns, frontend, jamming, link_budget
from gnss_hil.emulator.signal.jamming import Jammers


def transmitters_of(factor: TransmitPattern, day: date) -> link_budget.Transmit:
    """Transmitters of all satellites as they were on that day; ValueError if a block is not the system's."""
    return link_budget.transmit(blocks.block_rows(day, factor.gps, factor.blocks), factor.level)


def antennas_of(factor: ReceivePattern, names: tuple[str, ...]) -> antenna_patterns.Receive:
    """Antennas of these names (m,). ValueError if the factor names another, FileError if a table is bad."""
    strangers = sorted(set(factor.antennas) - set(names))
    if strangers:
        raise ValueError(f"antenna '{strangers[0]}' is not there; there are {', '.join(names)}")
    wanted = [factor.antennas.get(name, factor.pattern) for name in names]
    law_dbi = factor.gain_dbi, factor.gain_at_90deg_dbi
    found = {name: link_budget.pattern_of(name, factor.column, law_dbi) for name in wanted}
    return antenna_patterns.receive(tuple(found[name] for name in wanted), factor.floor_dbi)


def front_end_of(factor: LinkBudget) -> tuple[float, float]:
    """Noise density at the antennas' terminals [W/Hz], and loss of the digital part [dB]."""
    system_k = frontend.system_temperature_k(
        factor.antenna_temperature_k, factor.line_loss_db, factor.line_temperature_k, factor.noise_figure_db
    )
    return float(frontend.density_wphz(system_k)), factor.implementation_loss_db


def jammers_of(factor: Jamming) -> Jammers:
    """Jammers as arrays, those on the Earth first."""
    places = [
        jamming.place_ecef_m(np.radians(one.latitude_deg), np.radians(one.longitude_deg), one.height_m)
        for one in factor.earth
    ]
    every = (*factor.earth, *factor.body)
    return Jammers(
        np.array(places).reshape(-1, 3),
        np.array([one.eirp_dbw for one in factor.earth], float),
        np.array([one.direction_body for one in factor.body], float).reshape(-1, 3),
        np.array([one.received_dbw for one in factor.body], float),
        tuple(one.kind for one in every),
        np.array([one.centre_mhz * 1e6 for one in every], float),
        np.array([one.bandwidth_mhz * 1e6 for one in every], float),
    )
