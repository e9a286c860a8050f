"""report.html of a run folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common import vehicle as vehicles
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.common.gpstime import iso
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.recording.run_folder import SCENARIO, TRUTH
from gnss_hil.tools.report import (
    antenna_skies,
    assignment,
    attitude_plot,
    clock_plots,
    error_plots,
    events,
    fault_ledger,
    ground_track,
    relative_position,
    summary_tables,
    time_series,
)
from gnss_hil.tools.report.craft import Craft, gather
from gnss_hil.tools.report.document import Page, card, lead, note
from gnss_hil.tools.report.fault_ledger import Window
from gnss_hil.tools.report.markup import Markup, tag
from gnss_hil.tools.report.plot import Plot
from gnss_hil.tools.results import truth
from gnss_hil.tools.results.text import foreign_emulator, replayed

REPORT = "report.html"


def write(
    folder: Path,
    facts: Mapping[str, Any],
    summary: Mapping[str, Any],
    digests: Mapping[str, Digest],
    path: Path,
) -> None:
    """The report of a run whose tables and summary are written."""
    scenario = scenarios.parse(scenarios.read(folder / SCENARIO), str(folder / SCENARIO))
    kept = truth.read(folder / TRUTH) if (folder / TRUTH).exists() else None
    channels = folder / "channels.parquet"
    page = Page(f"{summary['scenario']}: report")
    began_ns = min(
        (int(d.timeline["t_ns"][0]) for d in digests.values() if len(d.timeline["t_ns"])), default=None
    )
    _head(page, scenario, summary, began_ns, fault_ledger.cards(folder, summary))
    latency = summary["epoch_latency_ms"]
    bench = time_series.latency(facts.get("latency_histogram", []), latency["p50"], latency["p99"])
    alone = len(scenario.craft) == 1
    crafts = []
    for craft in scenario.craft:
        name = craft.name
        rows = kept.of(name) if kept is not None and name in kept.craft else np.zeros(0)
        vehicle = vehicles.load(scenarios.vehicle_path(craft, folder / SCENARIO))
        table = channels if channels.exists() else None
        gathered = gather(name, vehicle, summary["epoch_interval_s"], digests[name], rows, table)
        acting = fault_ledger.windows(folder, scenario, name)
        _craft(page, gathered, summary, [bench] if alone else [], acting)
        crafts.append(gathered)
    if not alone:
        page.add(tag.h2("Relative position"))
        page.add_plots([relative_position.relative_position(crafts[0], other) for other in crafts[1:]])
        page.add(tag.h2("Bench"))
        page.add_plots([bench])
    if summary.get("remarks"):
        page.add(card("Remarks on its files", tag.ul(tag.li(remark) for remark in summary["remarks"])))
    page.add(card("What was run", summary_tables.about(facts.get("about", {}))))
    page.add(_foot(folder, kept is not None, channels.exists()))
    page.write(path)


def _head(
    page: Page, scenario: Scenario, s: Mapping[str, Any], began_ns: int | None, of_faults: list[Markup]
) -> None:
    """began_ns: the first time mark heard; what another's emulator played is known from the bus alone.

    of_faults   cards of what became of faults
    """
    bus = s["bus"]["interface"]
    way = f"{bus}:{s['bus']['channel']}" if s["bus"]["channel"] else bus
    facts = [
        f"policy {s['policy']}", f"seed {s['seed']}",
        "no time mark was heard" if began_ns is None else f"from {iso(began_ns).replace('T', ' ')} GPS time",
        f"{so_many(s['epochs'], 'epoch')} of {s['epoch_interval_s']:g} s",
        f"bus {way}, pace {s['pace']}" if way else "bus and pace unknown: the run broke off",
        "reproducible" if s["reproducible"] else "not reproducible",
    ]  # fmt: skip
    others = foreign_emulator(s)
    told = (
        f"Emulator: {s['emulator']}. What it played is known from the bus alone; scenario and vehicle file "
        "were handed to it."
    )
    page.add(
        tag.h1(s["scenario"]),
        lead(told) if others else lead(scenario.description) if scenario.description else None,
        lead(f"{'; '.join(facts)}."),
        *(lead(f"Remark: {remark}.") for remark in s.get("remarks", [])),
        summary_tables.verdict(s),
        summary_tables.bus_tiles(s),
    )
    judged = (
        ("Expectations", summary_tables.expectations(s), summary_tables.nothing_expected(s)),
        ("Frame faults", summary_tables.faults(s), summary_tables.NO_FAULTS),
    )
    cards = [*of_faults, *(card(title, table) for title, table, _ in judged if table is not None)]
    page.add(tag.div(cards, class_="grid") if cards else None)
    page.add(*(note(nothing) for _, table, nothing in judged if table is None and nothing))


def _craft(
    page: Page, craft: Craft, s: Mapping[str, Any], more: list[Plot], acting: Sequence[Window]
) -> None:
    """acting: windows of faults on its bus."""
    own = s["craft"][craft.name]
    whose = "as in the vehicle file handed over, " if foreign_emulator(s) else "vehicle "
    page.add(tag.h2(f"Craft {craft.name}, {whose}{craft.vehicle.name}"))
    page.add(summary_tables.craft_tiles(own, s["epochs"]))
    page.add(card("Figures", summary_tables.craft_table(own, replayed(s))))
    page.add(card("Epochs without a fix", summary_tables.no_fix_table(own, craft.without_fix)))
    page.add_plots(fault_ledger.shaded([assignment.assignment(craft)], acting), craft.name)
    page.add_plots(antenna_skies.skies(craft))
    if craft.sightings is not None:
        page.add(antenna_skies.legend())
    plots = [
            error_plots.position_error(craft), error_plots.velocity_error(craft),
            error_plots.consistency(craft), clock_plots.clock(craft), attitude_plot.attitude(craft),
            time_series.residuals_by_satellite(craft), time_series.satellites_by_antenna(craft),
            time_series.satellites(craft), time_series.dilution(craft),
            ground_track.ground_track(craft), ground_track.orbit(craft), time_series.strength(craft),
            time_series.load(craft),
            *more, events.events(craft), time_series.faults(craft),
    ]  # fmt: skip
    page.add_plots(fault_ledger.shaded(plots, acting), craft.name)


def _foot(folder: Path, has_truth: bool, has_channels: bool) -> Markup:
    parts = (("truth", has_truth), ("table of channels", has_channels))
    lacking = " and no ".join(name for name, there in parts if not there)
    without = f" The run has no {lacking}: what needs it is left out." if lacking else ""
    return tag.footer(
        f"Made by gnss-hil from run folder {folder.name}: bus frames decoded by the DBC, "
        f"and truth where it was kept.{without} Plots over time zoom together; double-click resets. "
        "Coastlines: Natural Earth, public domain."
    )
