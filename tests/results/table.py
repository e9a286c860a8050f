"""The table of results: what is shown, the command that gives it, how each figure is read.

A command is what a user types in the repository, with GNSS_HIL_DATA set to the folder of real data. Where it
names no `--out`, the runner adds one (and `--quiet`) to `gnss-hil run`; `RUN` stands for the folder.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from tests.results.readers import (
    Reader,
    apart_mm,
    cpu_us_per_epoch,
    elapsed,
    in_view,
    largest_printed,
    peak_mb,
    printed,
    study,
    summary,
    without_fix,
    worst_m,
)


@dataclass(frozen=True, slots=True)
class Result:
    """A row of the page.

    name     its key in docs/results.json
    what     its first cell
    command  lines for a shell
    figures  name of a figure -> how it is read
    cells    the other cells, formats of figures
    tier     "minutes" or "hours": what QUICK=1 takes and leaves
    shown    the output is kept, for the README
    idle     a speed: not measured while others use the machine
    """

    name: str
    what: str
    command: str
    figures: Mapping[str, Reader]
    cells: tuple[str, ...]
    tier: Literal["minutes", "hours"] = "minutes"
    shown: bool = False
    idle: bool = False


@dataclass(frozen=True, slots=True)
class Section:
    """A table of the page: heading, what to know, heads of the columns, rows."""

    title: str
    about: str
    heads: tuple[str, ...]
    results: tuple[Result, ...]


NAVIGATION = "$GNSS_HIL_DATA/navigation"
SKY = f"--nav {NAVIGATION}/brdc3050.12n.gz --nav {NAVIGATION}/brdc3050.12g.gz"
GRACE = "$GNSS_HIL_DATA/grace_b_2010-07-27"

FIGURES = {
    "satellites": summary("craft.*.satellites_tracked.mean"),
    "pdop": summary("craft.*.pdop_distinct.median"),
    "median_m": summary("craft.*.position_error_m.median"),
    "rms_m": summary("craft.*.position_error_m.rms"),
    "p95_m": summary("craft.*.position_error_m.p95"),
    "max_m": summary("craft.*.position_error_m.max"),
    "fixes": summary("craft.*.fixes"),
    "epochs": summary("epochs"),
}


def some(*names: str) -> dict[str, Reader]:
    return {name: FIGURES[name] for name in names}


SETTLED_S, DAY_ENDS_S = 120, 85_500  # second minute; 24:00 of a run from 00:15


def day(name: str, what: str, more: str) -> Result:
    return Result(
        f"day-{name}",
        what,
        f"gnss-hil run soyuz {SKY} --duration 1d --bus inline --no-log {more}",
        {
            **some("satellites", "pdop", "median_m"),
            "worst_m": worst_m(SETTLED_S, DAY_ENDS_S),
            "without": without_fix(SETTLED_S, DAY_ENDS_S),
        },
        ("{satellites:.1f}", "{pdop:.2f}", "{median_m:.2f} m", "{worst_m:.1f} m", "{without:.0f}"),
        "hours",
    )


RULES = {
    "elevation": "highest first",
    "boresight": "nearest to boresight",
    "prn": "lowest number",
    "gdop": "least GDOP",
}


def hours(policy: str, rule: str) -> Result:
    more = f"--policy {policy}" + (f" --autonomous {rule}" if rule else "")
    return Result(
        f"hours-{policy}{'-' if rule else ''}{rule}",
        f"{policy}, {RULES[rule]}" if rule else policy,
        f"gnss-hil run soyuz {SKY} --duration 6h --bus inline --no-log {more}",
        some("satellites", "median_m"),
        ("{median_m:.2f} m", "{satellites:.1f}"),
        "hours",
    )


def tests(name: str, what: str, test: str, figures: Mapping[str, Reader], cell: str) -> Result:
    """Figures that a test prints on its way."""
    return Result(name, what, f"python -m pytest -q -rP {test}", figures, (cell,))


GPS_BROADCAST = r"GPS.*: \d+ positions, median ([\d.]+) m.*; clocks median ([\d.]+) m"
GLONASS_BROADCAST = GPS_BROADCAST.replace("GPS", "GLONASS")
MILLIMETRES = r"([\d.]+) mm"

METHOD = Section(
    "The method, a day",
    "Soyuz, four antennas of six channels, 1 Hz from 2012-10-31 00:15 to 24:15 GPS time under that day's "
    "broadcast sky (IGS files brdc3050.12n and .12g), 32 GPS and 24 GLONASS satellites. Errors are thermal "
    "noise only; the broadcast orbits are the truth. The last ephemerides end at 24:00, so the last quarter "
    "of an hour has few satellites; it is in the first three columns. The last two count from the second "
    'minute to 24:00, as `python -c "import gnss_hil, polars as pl; '
    "e = gnss_hil.Run.read('RUN').errors"
    f".filter(pl.col('t_s').is_between({SETTLED_S}, {DAY_ENDS_S}, 'left')); "
    f"print(e['position_error_m'].max(), {DAY_ENDS_S - SETTLED_S} - len(e))\"` prints them of a run folder.",
    (
        "who assigns",
        "distinct satellites, mean",
        "PDOP over them, median",
        "3-D error, median",
        "worst",
        "epochs without a fix",
    ),
    (
        day("patent", "**patent**", "--policy patent"),
        day(
            "elevation",
            "receivers by themselves, highest first (the patent's prototype)",
            "--policy prototype --autonomous elevation",
        ),
        day("prn", "receivers by themselves, lowest number first", "--policy prototype --autonomous prn"),
        day(
            "boresight",
            "receivers by themselves, nearest to their own boresight",
            "--policy prototype --autonomous boresight",
        ),
        day(
            "clocks",
            "patent, one clock in each receiver instead of a common one",
            "--policy patent --vehicle soyuz-ms-4clocks",
        ),
    ),
)

COMPARISONS = Section(
    "The method, six hours",
    "The patent's other comparisons on the first six hours of the same sky. `prototype` solves all ranges "
    "together, `analogue` averages the receivers' own fixes, `single` takes the antenna that sees most. The "
    "errors of the last two contain the lever arm, 1 to 3 m, which they do not reduce: their position is "
    "that of antennas.",
    ("who assigns", "3-D error, median", "distinct satellites, mean"),
    (
        hours("patent", ""),
        *(hours(policy, rule) for policy in ("prototype", "analogue", "single") for rule in RULES),
    ),
)

ANTENNAS = Section(
    "Other antennas",
    "Boresights +Y, -Y, zenith and nadir (`cross`), six hours of the same sky: the literal rule leaves "
    "channels idle, one more rule fills them. The station that rolls (`iss-zenith`): satellites that the "
    "antennas hold, before the roll and after. The patent's figures are 7 to 12, 3 and 4 to 8; its 3 needs "
    "the station's structure in the way, which this scenario leaves out and `iss-roll` has, its antennas on "
    "Zvezda: there 3 to 8 and 4 to 8 after the roll but for moments of 9 (nominal sky, "
    "`tests/system/test_scenarios.py`).",
    ("what", "measured"),
    (
        Result(
            "cross", "`cross`, the literal rule: distinct satellites",
            f"gnss-hil run cross {SKY} --duration 6h --bus inline --no-log",
            some("satellites"), ("{satellites:.1f}",), "hours",
        ),
        Result(
            "cross-next", "`cross`, a full antenna passes on: distinct satellites",
            f"gnss-hil run cross {SKY} --duration 6h --bus inline --no-log --option overflow=next",
            some("satellites"), ("{satellites:.1f}",), "hours",
        ),
        Result(
            "iss-zenith",
            "`iss-zenith`, that day's GPS: zenith antenna; after the roll; tilted one after the roll",
            f"gnss-hil run iss-zenith --nav {NAVIGATION}/brdc3050.12n.gz --bus inline",
            {
                "low": in_view(1, 120, 5580, min), "high": in_view(1, 120, 5580, max),
                "rolled_low": in_view(1, 5760, 11160, min), "rolled_high": in_view(1, 5760, 11160, max),
                "tilted_low": in_view(2, 5760, 11160, min), "tilted_high": in_view(2, 5760, 11160, max),
            },
            ("{low:.0f} to {high:.0f}; {rolled_low:.0f} to {rolled_high:.0f}; "
             "{tilted_low:.0f} to {tilted_high:.0f}",),
        ),
    ),
)  # fmt: skip


def carriers(name: str, what: str, more: str) -> Result:
    return Result(
        f"carriers-{name}",
        what,
        f"gnss-hil run soyuz-l1l2 --duration 1h --bus inline --no-log {more}".rstrip(),
        some("fixes", "epochs", "median_m", "p95_m"),
        ("{fixes:,.0f} of {epochs:,.0f}", "{median_m:.2f} m", "{p95_m:.2f} m"),
    )


CARRIERS = Section(
    "Two carriers",
    "`soyuz-l1l2`, an hour of March 2023, high solar activity, nominal sky: pairs of channels on four "
    "antennas of twelve. The fixes that are missing are the cold start.",
    ("what", "fixes", "3-D error, median", "95 %"),
    (
        carriers("one", "by one carrier", "--option ionosphere_free=false"),
        carriers("pairs", "pairs of each epoch by themselves", "--option ionosphere_walk_mps_rts=0"),
        carriers("followed", "pairs, delays followed from epoch to epoch: as it ships", ""),
        carriers("all", "the same with every error factor", "--on all"),
        carriers("one-all", "by one carrier, every error factor", "--on all --option ionosphere_free=false"),
    ),
)

TRUTH = Section(
    "Truth against flight, and against others",
    "Two sides that share no model code, judged by each other, by published orbits, by other people's "
    "programs.",
    ("what", "measured"),
    (
        Result(
            "quiet", "no noise, clocks wandering by 1 ms, real sky, 3 h: fix against truth",
            f"gnss-hil run soyuz-quiet {SKY} --duration 3h --bus inline",
            some("rms_m", "max_m"), ("{rms_m:length} RMS, {max_m:length} at most",),
        ),
        Result(
            "iss-flown", "the ISS as flown on 2021-06-10 (telemetered orbit and attitude), no noise",
            "gnss-hil run iss-flown --off all --bus inline", some("rms_m"), ("{rms_m:length} RMS",),
        ),
        Result(
            "fsw-c",
            "the flight software in C against ours, which is told as little of the receivers, an hour, each "
            "in its own closed loop",
            "make -C examples/fsw_c\n"
            "mkdir -p RUN; sed '/^.receivers.$/,/^$/d' dbc/vehicles/soyuz-ms.toml >RUN/soyuz-ms.toml\n"
            "gnss-hil run soyuz --duration 1h --vehicle RUN/soyuz-ms.toml --out RUN/ours --quiet\n"
            "gnss-hil run soyuz --duration 1h --vehicle RUN/soyuz-ms.toml --flight examples/fsw_c/build/fsw "
            "--out RUN/c --quiet",
            {"apart_mm": apart_mm("ours", "c")}, ("{apart_mm:.2f} mm at most",),
        ),
        tests(
            "receiver-py", "a third party's receiver in Python against our flight software, its own truth",
            "tests/system/test_receiver_py.py",
            {"epochs": printed(r"(\d+) fixes, [\d.]+ mm"), "max_mm": printed(rf"fixes, {MILLIMETRES}")},
            "{epochs:.0f} fixes, {max_mm:.2f} mm at most",
        ),
        tests(
            "grace",
            "a real receiver, GRACE-B, the day 2010-07-27, ionosphere-free, against its published orbit",
            "tests/realdata/test_replay_grace.py",
            {
                "fixes": printed(r"GRACE-B: (\d+) fixes of (\d+)"), "epochs": printed(r"fixes of (\d+)"),
                "median_m": printed(r"'median': ([\d.]+)"), "p95_m": printed(r"'p95': ([\d.]+)"),
                "max_m": printed(r"'max': ([\d.]+)"),
            },
            "{fixes:,.0f} of {epochs:,.0f} epochs, {median_m:.2f} m median, {p95_m:.2f} m 95 %, {max_m:.0f} "
            "m at most",
        ),
        tests(
            "gps-broadcast", "GPS broadcast orbits and clocks against ESA's final products, 2023-03-23",
            "tests/realdata/test_broadcast_orbits.py -k gps_broadcast_against",
            {"orbit_m": printed(GPS_BROADCAST), "clock_m": printed(GPS_BROADCAST, 2)},
            "{orbit_m:.2f} m and {clock_m:.2f} m median",
        ),
        tests(
            "glonass-broadcast", "GLONASS broadcast orbits against ESA, 2009-04-01",
            "tests/realdata/test_broadcast_orbits.py -k glonass_broadcast_against",
            {"orbit_m": printed(GLONASS_BROADCAST)}, "{orbit_m:.2f} m median",
        ),
        tests(
            "heyoka",
            "truth dynamics (EGM2008 20 x 20, Sun, Moon), a day of LEO, GEO, Molniya, against heyoka",
            "tests/peers/test_heyoka_orbit.py -k gravity_sun_and_moon",
            {"max_m": largest_printed(r"^\w+ \(.*\): ([\d.e+-]+) m$")}, "{max_m:length} at most",
        ),
        tests(
            "rtklib", "RTKLIB on the exported centre-of-mass file of `soyuz`, errors off: against our fix",
            "tests/peers/test_rtklib.py",
            {"fix_mm": printed(r"- fix ([\d.]+) mm rms")}, "{fix_mm:.2f} mm RMS",
        ),
        tests(
            "reproducible", "the same bytes on inline, embedded, late, paused, hogged",
            "tests/system/test_reproducible.py", {"passed": printed(r"(\d+) passed")},
            "SHA-256 equal ({passed:.0f} tests)",
        ),
    ),
)  # fmt: skip

ONE_BY_ONE = " ".join(
    f"--factor {name}"
    for name in (
        "code_noise", "ephemeris_error", "satellite_clock_error", "code_bias", "ionosphere",
        "clock_instability", "interchannel_bias", "onboard_clock", "multipath",
    )
)  # fmt: skip
"""Those that touch code positions: the table of docs/factors.md."""

ERRORS = Section(
    "Errors",
    "What error factors do; [factors.md](factors.md) has them one by one.",
    ("what", "measured"),
    (
        Result(
            "all-factors", "every factor on, `soyuz`, a quarter of an hour",
            "gnss-hil run soyuz --on all --duration 900 --bus inline",
            some("fixes", "epochs", "median_m"),
            ("{fixes:.0f} of {epochs:.0f} epochs, {median_m:.1f} m median",),
        ),
        Result(
            "station", "the station, two orbits, every factor on",
            "gnss-hil run iss --bus inline", some("median_m", "rms_m", "p95_m", "max_m"),
            ("{median_m:.1f} m median, {rms_m:.1f} m RMS, {p95_m:.1f} m 95 %, {max_m:.0f} m at most",),
        ),
        Result(
            "cancel",
            "errors of orbits, satellite clocks, ionosphere in the difference of two craft 1 km apart",
            f"gnss-hil study factors --duration 30000 --interval 10 {ONE_BY_ONE} --out RUN --quiet",
            {f: study(f, "cancels") for f in ("ephemeris_error", "satellite_clock_error", "ionosphere")},
            ("cancel {ephemeris_error:,.0f}, {satellite_clock_error:,.0f} and {ionosphere:,.0f} times",),
            "hours",
        ),
    ),
)  # fmt: skip

SPEED = Section(
    "Speed and size",
    "CPU time is user and system time of the whole command, start-up included, over the epochs; times real "
    "time depend on what else the machine does.",
    ("what", "measured"),
    (
        Result(
            "inline", "inline, recorder included, ten minutes",
            "gnss-hil run soyuz --bus inline",
            {"cpu_us": cpu_us_per_epoch, "times": summary("real_time_factor")},
            ("{times:.0f} times real time; {cpu_us:,.0f} us CPU an epoch with start-up and report",),
            idle=True,
        ),
        Result(
            "inline-all", "the same with every factor on",
            "gnss-hil run soyuz --bus inline --on all",
            {"cpu_us": cpu_us_per_epoch, "times": summary("real_time_factor")},
            ("{times:.0f} times real time; {cpu_us:,.0f} us CPU an epoch with start-up and report",),
            idle=True,
        ),
        Result(
            "embedded", "embedded: two processes and the recorder",
            "gnss-hil run soyuz",
            {
                "cpu_us": cpu_us_per_epoch, "times": summary("real_time_factor"),
                "p50": summary("epoch_latency_ms.p50"), "p99": summary("epoch_latency_ms.p99"),
            },
            ("{cpu_us:,.0f} us CPU an epoch, {times:.0f} times real time; epoch latency {p50:.1f} ms p50, "
             "{p99:.1f} ms p99",),
            shown=True,
        ),
        Result(
            "one-epoch", "start-up: a run of one epoch, whole process",
            "gnss-hil run soyuz --duration 1 --bus inline", {"cpu_us": cpu_us_per_epoch},
            ("{cpu_us:,.0f} us CPU",),
            idle=True,
        ),
        Result(
            "help", "`gnss-hil --help`", "gnss-hil --help",
            {"elapsed_s": elapsed}, ("{elapsed_s:.2f} s",), idle=True,
        ),
        Result(
            "codec", "codec in batches of 240 against cantools",
            "python -m tests.benchmarks.codec",
            {"decode": printed(r"decoding ([\d.]+) times"), "encode": printed(r"encoding ([\d.]+) times")},
            ("decoding {decode:.0f} times, encoding {encode:.0f} times as fast",),
            idle=True,
        ),
        Result(
            "memory", "memory of a day without log: largest process",
            "gnss-hil run soyuz --duration 1d --bus inline --no-log --out RUN --quiet", {"peak_mb": peak_mb},
            ("{peak_mb:.0f} MB",), "hours",
        ),
        Result(
            "memory-log", "memory of a day with log: largest process",
            "gnss-hil run soyuz --duration 1d --bus inline --out RUN --quiet", {"peak_mb": peak_mb},
            ("{peak_mb:.0f} MB",), "hours",
        ),
        Result(
            "clone", "what `make run` installs after a `git clone`: the environment",
            "git clone -q . RUN/gnss-hil && make -s -C RUN/gnss-hil run && du -sm RUN/gnss-hil/.venv",
            {"size_mb": printed(r"^(\d+)\s+\S*\.venv$")}, ("{size_mb:.0f} MB",),
        ),
    ),
)  # fmt: skip

SECTIONS = (METHOD, COMPARISONS, ANTENNAS, CARRIERS, TRUTH, ERRORS, SPEED)
RESULTS = {result.name: result for section in SECTIONS for result in section.results}
