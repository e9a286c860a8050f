"""What all craft of a world have in common, and models from the rows that are on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.config.tables import Tell
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac
from gnss_hil.emulator.constellation.base import ReportErrors
from gnss_hil.emulator.constellation.sky import Sky
from gnss_hil.emulator.earth.sun_table import Sun
from gnss_hil.emulator.environment.block import SkyCache
from gnss_hil.emulator.environment.models import Models, acting
from gnss_hil.emulator.error_models import ionosphere
from gnss_hil.emulator.error_models.base import (
    BlockModel,
    Context,
    CraftContext,
    ReportInput,
    ReportTerm,
    Stage,
    StageOf,
)
from gnss_hil.emulator.error_models.checked import ModelError, checked, name_of
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.emulator.files import finals, ionosphere_header
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.orbits.motion import Motion, build_motion
from gnss_hil.emulator.signal.ionosphere.klobuchar import Coefficients, as_broadcast


@dataclass(frozen=True, slots=True, eq=False)
class Shared:
    """What all craft of a world have in common.

    models      those of the sky, by stage
    measured    the Earth's orientation, None without a file of it
    motion_of   the motion of a craft by its name, ScenarioError if it has none that is known
    ionosphere  as satellites broadcast it, None without one
    period_s    wall time between two epochs, None where none is set
    tell        takes remarks
    """

    given: scenario.Scenario
    session: int
    open_path: Callable[[str], Path]
    sky: Sky
    cache: SkyCache
    sun: Sun
    almanac: HeldAlmanac | None
    row_of: I64
    models: Models
    measured: finals.Orientation | None
    motion_of: Callable[[str], Motion]
    ionosphere: Coefficients | None
    period_s: float | None
    tell: Tell


def broadcast_ionosphere(given: scenario.Scenario, open_path: Callable[[str], Path]) -> Coefficients | None:
    """What satellites say of the ionosphere: of that which acts on emulated receivers; for recorded ones what
    the header of a navigation file has. None without one."""
    params = given.sky.factors.on().get(ionosphere.ROW.name)
    if isinstance(params, ionosphere.Ionosphere):
        return ionosphere.broadcast(params, [open_path(name) for name in params.files])
    if all(craft.observations is None for craft in given.craft):
        return None
    sources = [source for source in given.sky.sources().values() if source not in ("nominal", "none")]
    for name in [name for each in sources for name in ([each] if isinstance(each, str) else each)]:
        with suppress(FileError):  # a file without coefficients; what else is wrong with it the sky has told
            header = ionosphere_header.read(open_path(name))
            return as_broadcast(Coefficients(header.alpha, header.beta))
    return None


def motions(
    given: scenario.Scenario, measured: finals.Orientation | None, tell: Tell
) -> Callable[[str], Motion]:
    """Motions of a scenario's craft by name, each built when it is first asked for."""
    of_name = {craft.name: craft for craft in given.craft}

    @cache
    def motion_of(name: str) -> Motion:
        craft = of_name.get(name)
        if craft is None or craft.observations is not None:
            raise ScenarioError(f"craft '{name}': there is none with an orbit or a trajectory")
        return build_motion(name, craft.orbit, craft.trajectory, given.time, measured, tell)

    return motion_of


def context_of(given: scenario.Scenario, key: int, index: I64, open_path: Callable[[str], Path]) -> Context:
    time = given.time
    return Context(given.seed, key, time.start_ns, time.interval_ns, time.span_ns, index, open_path)


def models_of(rows: Mapping[str, Factor], context: Context, owner: str) -> Models:
    """Models of rows that are on, by stage, under the checks of their stages.

    owner   whose they are, for people: "sky", "craft soyuz"
    Raises what a row's `build` says cannot be had (ValueError, FileError); ModelError of what else it raises.
    """
    antennas = context.vehicle.antennas if isinstance(context, CraftContext) else 0
    found: dict[StageOf, tuple[Any, ...]] = {}
    for name, params in rows.items():
        row = FACTORS[name]
        try:
            model = row.build(params, context)
        except (ValueError, FileError):
            raise
        except Exception as error:
            fault = f"{type(error).__name__}: {error}"
            raise ModelError(f"{name_of(name, row.stage, owner)}: {fault}") from error
        one = checked(model, name, row.stage, owner, antennas)
        found[row.stage] = (*found.get(row.stage, ()), one)
    return found


def merged(own: Models, of_sky: Models) -> Models:
    return {stage: (*own.get(stage, ()), *of_sky.get(stage, ())) for stage in {**own, **of_sky}}


def models_of_sky(given: scenario.Scenario, open_path: Callable[[str], Path], index: I64) -> Models:
    """Models of the sky, the same for all craft."""
    context = context_of(given, keyed_draws.SKY_KEY, index, open_path)
    found: Models = {}
    for name, params in given.sky.factors.on().items():
        try:
            found = merged(found, models_of({name: params}, context, "sky"))
        except (ValueError, FileError) as error:
            raise ScenarioError(f"sky.factors.{name}: {error}") from None
    return found


def report_errors(models: Models) -> list[ReportErrors]:
    """What makes satellites report something else than the truth."""

    def errors_of(model: BlockModel[ReportInput, ReportTerm]) -> ReportErrors:
        def errors(middles_ns, nodes_s, pos_m, vel_mps):
            term = model.block(ReportInput(middles_ns, nodes_s, pos_m, vel_mps))
            return term.off_ecef_m, term.off_clock_m

        return errors

    return [errors_of(model) for model in acting(models, Stage.BROADCAST)]
