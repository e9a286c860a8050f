"""What every error model is made of, and how a new one comes in.

An error model is one row in one file of this room: its parameters, the source of its formulas, a function
that builds it, and the stage of the run in which it acts. The registry lists the rows; scenarios, command
line, documents and the emulator's stages read them there. To add one: write the file, name its row in the
registry, test it (every row is tested to show on the bus). Nothing else names any model.

A model is a class with one method, `block`, or `step` in the last two stages. What it is asked with and what
it answers are its stage's; the type checker refuses a row whose model is not of its stage:

    stage       asked with                 answers by         terms of a stage join by
    BROADCAST   ReportInput                ReportTerm         sum
    OSCILLATOR  Epochs                     (k, 2, 8)          exactly one; without, a bounded wander
    LATCH       Epochs                     (k,) [s]           sum
    ATTITUDE    Epochs                     AttitudeTerm       sum of small angles and rates
    LINK        None, once a run           LinkTerm           merge: a field is of one model
    VISIBILITY  EpochGeometry              VisibilityTerm     every model has to let a signal pass
    PATH        ChannelGeometry            PathTerm           sum
    TRACKING    ChannelGeometry, None      TrackingTerm       sum; one alone times the collection
    OBSERVABLE  state, Measured, epoch     ObservableTerm     sum
    FRAMES      state, FrameBatch, epoch   FrameBatch         one after another

Stages down to PATH are of the environment, which no command changes: they are worked out for a block of
epochs at once, and their answers are pure functions of the epoch. So is that of TRACKING. The last two are
stepped with the receivers: their state, None at first, is answered before the term and handed on.

Where there is room for one model only (OSCILLATOR), "all" means the first row of the registry, or the one
that a scenario or the command line names; a further clock model is on where it is named.

Every answer is looked at (`checked`): its type, its shape, finite numbers. A model that fails or answers
something else ends the run with one line of its row, stage and craft.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, Protocol, TypeVar

import numpy as np

from gnss_hil.dbc.common import satellites, systems
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.signal.antenna_patterns import Receive
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry
from gnss_hil.emulator.signal.jamming import Jammers
from gnss_hil.emulator.signal.link_budget import Transmit
from gnss_hil.emulator.signal.loops import Loops

At = TypeVar("At", contravariant=True)
Term = TypeVar("Term", covariant=True)
Model = TypeVar("Model", covariant=True)
Constant = TypeVar("Constant")


@dataclass(frozen=True, slots=True)
class Epochs:
    """A stretch of a run: number of the first epoch, how many there are; start and interval of the run
    [ns]."""

    first: int
    count: int
    start_ns: int
    interval_ns: int

    @property
    def number(self) -> I64:
        """(k,)"""
        return np.arange(self.first, self.first + self.count)

    @property
    def mark_ns(self) -> I64:
        """(k,) time marks."""
        return self.start_ns + self.number * self.interval_ns


@dataclass(frozen=True, slots=True, eq=False)
class ReportInput:
    """middles_ns (s,) of segments of GPS time, nodes_s (k,) relative to them; true positions and velocities
    (s, k, n, 3) of the satellites there, ECEF."""

    middles_ns: I64
    nodes_s: F64
    pos_ecef_m: F64
    vel_ecef_mps: F64


@dataclass(frozen=True, slots=True, eq=False)
class ReportTerm:
    """Reported minus true: positions (s, k, n, 3) and clocks (s, k, n) [m], or numbers for all."""

    off_ecef_m: F64 | float = 0.0
    off_clock_m: F64 | float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeTerm:
    """Reported body axes turned from the true ones by angle_rad, and reported minus true rate_rps; (k, 3)."""

    angle_rad: F64
    rate_rps: F64


@dataclass(frozen=True, slots=True, eq=False)
class LinkTerm:
    """Parts of the link budget, None where it leaves one out.

    transmitters   of all satellites;  antennas  of the craft
    noise_wphz     noise density at the antennas' terminals [W/Hz], one or (m,)
    loss_db        of the digital part
    jammers        what else arrives
    """

    transmitters: Transmit | None = None
    antennas: Receive | None = None
    noise_wphz: F64 | float | None = None
    loss_db: float | None = None
    jammers: Jammers | None = None


@dataclass(frozen=True, slots=True, eq=False)
class VisibilityTerm:
    """What keeps a signal from a loop.

    hides   candidates (k, m, n) -> those among them whose direct ray is hidden; None: none is
    holds   C/N0 (...) [dBHz] -> whether loops hold a signal once they have it; None: as long as it is found
    """

    hides: Callable[[Bool], Bool] | None = None
    holds: Callable[[F64], Bool] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PathTerm:
    """What is added to signals, (p,) each or one number for all.

    range_m, phase_m, rate_mps   to pseudorange [m], carrier phase [m], range rate [m/s]
    turns_cyc    to the carrier phase, known but for whole cycles: a loop counts them on from epoch to epoch
    level_db     to C/N0, relative to the direct ray unobstructed; -inf where nothing arrives
    """

    range_m: F64 | float = 0.0
    phase_m: F64 | float = 0.0
    rate_mps: F64 | float = 0.0
    turns_cyc: F64 | None = None
    level_db: F64 | float = 0.0

    def __add__(self, other: PathTerm) -> PathTerm:
        turns = (
            other.turns_cyc
            if self.turns_cyc is None
            else self.turns_cyc
            if other.turns_cyc is None
            else self.turns_cyc + other.turns_cyc
        )
        return PathTerm(
            self.range_m + other.range_m,
            self.phase_m + other.phase_m,
            self.rate_mps + other.rate_mps,
            turns,
            self.level_db + other.level_db,
        )


@dataclass(frozen=True, slots=True, eq=False)
class ObservableTerm:
    """What is added to measurements, (p,) each or one number for all: to pseudorange [m], carrier phase [m],
    range rate [m/s], C/N0 [dB]. A channel with a value that the bus cannot carry is left out whole."""

    range_m: F64 | float = 0.0
    phase_m: F64 | float = 0.0
    rate_mps: F64 | float = 0.0
    level_db: F64 | float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class TrackingTerm:
    """How channels track.

    half_cycles     (p,) by which carrier phases slip in the epoch; None: never
    collection_ns   systems and times from which satellites are received, (...,) [ns] -> time until their
                    ephemerides are collected [ns]; None: one fixed time
    shared          whether the receivers of a craft share with each other what they have collected
    """

    half_cycles: I64 | None = None
    collection_ns: Callable[[I64, I64], I64] | None = None
    shared: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Signals that channels measure in an epoch, (p,) each: receiver and channel (0-based), satellite index,
    C/N0 [dBHz], value of the contract's table "Signal"; t_ns latch."""

    t_ns: int
    receiver: I64
    channel: I64
    sat: I64
    cn0_dbhz: F64
    signal: I64


class BlockModel(Protocol[At, Term]):
    """A model of the environment."""

    def block(self, at: At, /) -> Term:
        """A pure function."""
        ...


class SteppedModel(Protocol[At, Term]):
    """A model that is stepped with the receivers, an epoch after the other."""

    def step(self, state: Any, at: At, epoch: int, /) -> tuple[Any, Term]: ...


class PathModel(ABC):
    """A model of the stage PATH.

    leads     asked before the others, which meet the C/N0 that it leaves: its level counts for their noise,
              that of the others for the C/N0 that is measured
    reaches   asked, too, for signals whose direct ray is hidden, still received at its level
    """

    leads: bool = False
    reaches: bool = False

    @abstractmethod
    def block(self, at: ChannelGeometry, /) -> PathTerm: ...


@dataclass(frozen=True, slots=True)
class Fixed(Generic[Constant]):
    """A model whose term is the same in all of a run."""

    term: Constant

    def block(self, at: object, /) -> Constant:
        return self.term


@dataclass(frozen=True, slots=True)
class StageOf(Generic[Model]):
    """A stage and the models that act in it. single: it has room for one."""

    name: str
    asks: Literal["block", "step"] = "block"
    single: bool = False


class Stage:
    """Where in a run a model acts, in the order in which stages follow each other."""

    BROADCAST: ClassVar[StageOf[BlockModel[ReportInput, ReportTerm]]] = StageOf("broadcast")
    OSCILLATOR: ClassVar[StageOf[BlockModel[Epochs, F64]]] = StageOf("oscillator", single=True)
    LATCH: ClassVar[StageOf[BlockModel[Epochs, F64]]] = StageOf("latch")
    ATTITUDE: ClassVar[StageOf[BlockModel[Epochs, AttitudeTerm]]] = StageOf("attitude")
    LINK: ClassVar[StageOf[BlockModel[None, LinkTerm]]] = StageOf("link")
    VISIBILITY: ClassVar[StageOf[BlockModel[EpochGeometry, VisibilityTerm]]] = StageOf("visibility")
    PATH: ClassVar[StageOf[PathModel]] = StageOf("path")
    TRACKING: ClassVar[StageOf[BlockModel[ChannelGeometry | None, TrackingTerm]]] = StageOf("tracking")
    OBSERVABLE: ClassVar[StageOf[SteppedModel[Measured, ObservableTerm]]] = StageOf("observable", "step")
    FRAMES: ClassVar[StageOf[SteppedModel[FrameBatch, FrameBatch]]] = StageOf("frames", "step")


@dataclass(frozen=True, slots=True, eq=False)
class Context:
    """What models are built from: never a scenario.

    seed         of the run;  key of their draws: the craft's, or that of the sky
    start_ns, interval_ns   of the run [ns];  span_ns its first and last epoch
    satellites   (n,) index of each row of the sky
    open_path    name of a file as the scenario writes it -> the file
    """

    seed: int
    key: int
    start_ns: int
    interval_ns: int
    span_ns: tuple[int, int]
    satellites: I64
    open_path: Callable[[str], Path]

    def stream(self, name: str) -> Stream:
        """The draws of a model by its row's name."""
        return Stream(self.seed, self.key, name)


@dataclass(frozen=True, slots=True, eq=False)
class CraftContext(Context):
    """What models of a craft are built from besides: its vehicle and the loops of its receivers."""

    vehicle: Vehicle
    loops: Loops


def require_systems(context: Context, known: Collection[int], what: str) -> None:
    """ValueError if a satellite of the sky is of none of the known systems: the model has no `what` of it."""
    for value in np.unique(satellites.system_of(context.satellites)).tolist():
        if value not in known:
            row = systems.by_value(value)
            raise ValueError(f"no {what} of {row.name if row else value} are known")


Need = Literal["structure"]


@dataclass(frozen=True, slots=True)
class Row(Generic[Model]):
    """An error model.

    stage    where it acts
    params   its parameters, which validate themselves
    source   of its formulas
    build    parameters and context -> the model; ValueError or FileError with one line if it cannot be had
    scope    "sky": one for all craft, in [sky.factors]; "craft": each craft's own, in [craft.factors]
    default  on where a scenario does not name it
    ready    works with its defaults; one that does not is no part of "all" (see `registry.of_all`)
    needs    what the craft must have
    acts_on  "report": what satellites report; "receiver": an emulated receiver, which a recorded one is not
    shows    kind of frames that it must change; with the parameters `example`, where its defaults do nothing
             within seconds
    """

    name: str
    params: type[Factor]
    stage: StageOf[Model]
    source: str
    build: Callable[[Any, Any], Model]
    scope: Literal["sky", "craft"] = "craft"
    default: bool = False
    ready: bool = True
    needs: frozenset[Need] = frozenset()
    acts_on: Literal["report", "receiver"] = "receiver"
    shows: str = "RANGE"
