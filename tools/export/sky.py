"""A nominal sky as files that fly it again: its satellites' orbits, and the messages about them, which are
off by what the factors of the sky make them."""

from __future__ import annotations

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.emulator.constellation.nominal import NominalConstellation
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export import navigation, satellite_orbits, sp3
from gnss_hil.tools.export.rinex import NAVIGATION, File

ORBITS = "orbits.sp3"
ABOUT = "A made-up sky: no satellite flew or sent this."


def files_of(scenario: Scenario) -> list[File]:
    """Navigation file, as `--nav` takes it, and precise orbits, as `--sp3` does, for the time of a scenario.

    Mistake if satellites are not nominal ones: those of files are in files.
    """
    sky = navigation.constellations(scenario)
    if scenario.sky.orbits or not all(isinstance(one, NominalConstellation) for one in sky.values()):
        raise Mistake(f"{scenario.name}: its sky is of files already; export sky writes nominal ones")
    span_ns = scenario.time.span_ns
    records = navigation.messages(sky, span_ns, False, navigation.errors_of(scenario, sky))
    orbits = satellite_orbits.centres_of_mass(sky, span_ns, ABOUT)
    count = sum(len(rows) for rows in records.values())
    return [
        File(NAVIGATION, navigation.text_of(records, span_ns[0], False, ABOUT), so_many(count, "record")),
        File(
            ORBITS,
            sp3.text_of(orbits),
            f"{so_many(len(orbits.names), 'satellite')}, {so_many(len(orbits.t_ns), 'epoch')}",
        ),
    ]
