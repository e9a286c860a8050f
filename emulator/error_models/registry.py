"""Error factors of the emulated sky, craft and receivers: one registry, one row each.

A row has a name, a parameter model, the source of its formulas, where it belongs, and whether it is on if a
scenario says nothing of it. From the table come the scenario's validation, the command line's choices and
the documentation. A row is applied by whom it concerns: what disturbs measured signals by
`emulator.error_models.observable_effects`, what satellites report by `emulator.constellation.sky`, C/N0 by
`emulator.signal.link_budget_in_run`, structures by `emulator.signal.structure_effects`, clocks, loops and
sensors by `emulator.error_models.craft_models`, and how receivers work by `emulator.assemble`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.error_models.base import Factor
from gnss_hil.emulator.error_models.params_ionosphere import Ionosphere
from gnss_hil.emulator.error_models.params_link import (
    Jamming,
    LinkBudget,
    ReceivePattern,
    TransmitPattern,
)
from gnss_hil.emulator.error_models.params_loops import CarrierNoise, CodeNoise, DopplerNoise
from gnss_hil.emulator.error_models.params_onboard import AttitudeError, OnboardClock
from gnss_hil.emulator.error_models.params_receiver import (
    ClockInstability,
    CycleSlips,
    DataCollection,
    InterchannelBias,
    LossOfLock,
    PhaseWindup,
)
from gnss_hil.emulator.error_models.params_sky import CodeBias, EphemerisError, SatelliteClockError
from gnss_hil.emulator.error_models.params_structure import Multipath, Shadowing


@dataclass(frozen=True, slots=True)
class Row:
    """A factor.

    scope    "sky": one for all craft, in [sky.factors]; "craft": each craft's own, in [craft.factors]
    default  on where a scenario does not name it
    ready    works with its defaults; one that does not is no part of "all"
    """

    name: str
    model: type[Factor]
    source: str
    scope: Literal["sky", "craft"] = "craft"
    default: bool = False
    ready: bool = True


_LOOPS = "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9"

FACTORS = table(
    Row("code_noise", CodeNoise, f"{_LOOPS}: DLL thermal noise", default=True),
    Row("carrier_noise", CarrierNoise, f"{_LOOPS}: PLL thermal noise", default=True),
    Row("doppler_noise", DopplerNoise, f"{_LOOPS}: FLL thermal noise", default=True),
    Row(
        "ephemeris_error",
        EphemerisError,
        "Montenbruck, Steigenberger & Hauschild, GPS Solutions 19 (2015) 321; Hill's equations",
        "sky",
    ),
    Row("satellite_clock_error", SatelliteClockError, "the same; Allan deviations by kind of clock", "sky"),
    Row("code_bias", CodeBias, "differences of P1 and C1 in IGS's cc2noncc (J. Ray)", "sky"),
    Row("ionosphere", Ionosphere, "IS-GPS-200, 20.3.3.5.2.5; IONEX 1.0; Chapman layers", "sky"),
    Row(
        "clock_instability",
        ClockInstability,
        "van Dierendonck, McGraw & Brown, 16th PTTI (1984) 273",
    ),
    Row(
        "interchannel_bias",
        InterchannelBias,
        "Jiang & Lewandowski, Int. J. Navigation Observ. (2012) 353961, table 7",
    ),
    Row("cycle_slips", CycleSlips, "Viterbi, Proc. IEEE 51 (1963) 1737"),
    Row("loss_of_lock", LossOfLock, "Kaplan & Hegarty, 3rd ed., 8.9: rules of thumb of PLL and DLL"),
    Row("phase_windup", PhaseWindup, "Wu et al., Manuscripta Geodaetica 18 (1993) 91"),
    Row("data_collection", DataCollection, "IS-GPS-200, 20.3.2; GLONASS ICD 5.1, 4.3"),
    Row("attitude_error", AttitudeError, "Farrenkopf, J. Guidance and Control 1 (1978) 282"),
    Row("onboard_clock", OnboardClock, "IEEE Std 1139-2008, annex B: walk of white frequency noise"),
    Row("transmit_pattern", TransmitPattern, "published patterns by block; IS-GPS-200, GLONASS ICD 5.1"),
    Row("receive_pattern", ReceivePattern, "tables by angle, shipped or of a file"),
    Row("link_budget", LinkBudget, "Friis, Proc. IRE 32 (1944) 419"),
    Row("jamming", Jamming, "Betz, ION NTM 2000; Kaplan & Hegarty, 3rd ed., 9.2", ready=False),
    Row("shadowing", Shadowing, "Kay & Kajiya, Computer Graphics 20 (1986) 269"),
    Row("multipath", Multipath, "van Nee, IEEE Trans. AES 29 (1993) 1359; Kaplan & Hegarty, 3rd ed., 9.5"),
)


def of_scope(scope: str) -> dict[str, Row]:
    """The rows that belong to the sky, or to each craft."""
    return {name: row for name, row in FACTORS.items() if row.scope == scope}
