"""Examples of the keys' values: those of files that ship, and for keys that none of them has, a table."""

from __future__ import annotations

from typing import Any

from gnss_hil.tools.schema.json_schema import KINDS

WRITTEN: dict[str, dict[str, Any]] = {
    "scenario": {
        "time.orientation": "environment/finals2000A.all.gz",
        "sky.gps": ["brdc3050.12n"],
        "sky.glonass": ["brdc3050.12g"],
        "sky.orbits": ["igs17121.sp3"],
        "sky.almanac": ["gps.yuma", "glonass.agl"],
        "sky.factors.code_bias.p1_c1_ns": {"G05": -0.4},
        "sky.factors.ionosphere.alpha": [1.1e-8, 0.0, -6e-8, 0.0],
        "sky.factors.ionosphere.beta": [9e4, 0.0, -2e5, 0.0],
        "sky.factors.ionosphere.files": ["codg2080.10i"],
        "sky.factors.ionosphere.peak_height_km": 350,
        "sky.factors.ionosphere.bottomside_scale_km": 45,
        "sky.factors.ionosphere.topside_scale_km": 70,
        "sky.factors.ionosphere.plasmasphere_scale_km": 3000,
        "sky.factors.ionosphere.plasmasphere_share": 0.15,
        "craft.orbit.semi_major_axis_km": 26600,
        "craft.orbit.eccentricity": 0.72,
        "craft.orbit.forces": ["egm2008", "sun", "moon", "drag"],
        "craft.trajectory.oem": "grace-b.oem",
        "craft.trajectory.tle": "iss.tle",
        "craft.trajectory.object": "25544",
        "craft.observations.signals": ["L1CA", "L2P"],
        "craft.observations.reference.oem": "grace-b.oem",
        "craft.observations.reference.tle": "grace.tle",
        "craft.observations.reference.csv": "grace-b.csv",
        "craft.observations.reference.object": "27392",
        "craft.attitude.roll_deg": 35.0,
        "craft.clock.mark_domain": 0,
        "craft.factors.transmit_pattern.gps": "gps-iii",
        "craft.factors.transmit_pattern.blocks": {"G05": "gps-iif"},
        "craft.factors.receive_pattern.antennas": {"fore": "patch.txt"},
        "craft.factors.receive_pattern.column": "gain_dbi",
        "craft.factors.jamming.earth.latitude_deg": 55.75,
        "craft.factors.jamming.earth.longitude_deg": 37.62,
        "craft.factors.jamming.earth.eirp_dbw": 30.0,
        "craft.factors.jamming.body.direction_body": [0.0, 0.0, 1.0],
        "craft.factors.jamming.body.received_dbw": -130.0,
        "craft.factors.multipath.bandwidth_mhz": 8.0,
        "expect.NAME.min": 23,
        "expect.NAME.max": 2.5,
    },
    "vehicle": {},
    "structure": {"box.joint": "port alpha"},
}
"""Kind of file -> key with its path -> value. A test checks each against the schema."""


FIRST = ("soyuz", "soyuz-ms")
"""Files whose values are shown rather than others'."""


def examples(kind: str) -> dict[str, Any]:
    """Key with its path -> an example of its value, for keys that are written or in a file that ships."""
    found: dict[str, Any] = {}
    shipped = KINDS[kind].shipped()
    for path in sorted(shipped.values(), key=lambda path: path.stem not in FIRST):
        _collect(KINDS[kind].read(path), "", found)
    return {**found, **WRITTEN[kind]}


def _collect(table: dict[str, Any], path: str, found: dict[str, Any]) -> None:
    for name, value in table.items():
        key = f"{path}.{name}".lstrip(".")
        rows = value if isinstance(value, list) and value and isinstance(value[0], dict) else [value]
        for row in rows:
            if isinstance(row, dict):
                _collect(row, key, found)
            else:
                found.setdefault(key, value)
