"""Error models whose answers are looked at: what is not of its stage is an error with the model's name.

A model that answers nonsense would else be seen as a run without fixes, or as an error of whatever takes its
answer next. Here a model that raises, or whose answer is not of the type, the shape or the size that its
stage asks for (see `base`), ends the run with one line: which row, at which stage, of which craft, and what
it is. What the bus cannot carry is no fault: a measurement out of its signal's range is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from gnss_hil.dbc.common.systems import CLOCK_DOMAINS
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.emulator.error_models.base import (
    AttitudeTerm,
    LinkTerm,
    ObservableTerm,
    PathModel,
    PathTerm,
    ReportTerm,
    Stage,
    StageOf,
    TrackingTerm,
    VisibilityTerm,
)
from gnss_hil.emulator.signal.antenna_patterns import Receive
from gnss_hil.emulator.signal.jamming import Jammers
from gnss_hil.emulator.signal.link_budget import Transmit

FURTHEST_S = 1.5
"""What clocks may be off: no pseudorange on the bus is longer than 1.47 light seconds."""


class ModelError(Exception):
    """An error model or a sensor does not answer as it has to; one line for people."""


class Fault(ValueError):
    """What is wrong with an answer, without the name of whose it is."""


@dataclass(frozen=True, slots=True)
class Checked:
    """A model, and the checks of its answers; asked as the model itself is.

    name      what errors call it: row, stage and craft
    stage     where it acts
    antennas  of its craft; 0: it is of the sky
    leads, reaches   of a model of the stage PATH
    """

    model: Any
    name: str
    stage: StageOf
    antennas: int = 0
    leads: bool = field(init=False)
    reaches: bool = field(init=False)

    def __post_init__(self):
        for flag in ("leads", "reaches"):
            object.__setattr__(self, flag, bool(getattr(self.model, flag, False)))

    def block(self, at: Any) -> Any:
        try:
            return _CHECKS[self.stage](self, self.model.block(at), at)
        except Exception as error:
            raise self._told(error) from error

    def step(self, state: Any, at: Any, epoch: int) -> tuple[Any, Any]:
        try:
            answer = self.model.step(state, at, epoch)
            if not (isinstance(answer, tuple) and len(answer) == 2):
                raise Fault(f"answers {_said(answer)}; asked for are its state and a term")
            return answer[0], _CHECKS[self.stage](self, answer[1], at)
        except Exception as error:
            raise self._told(error) from error

    def calling(self, what: str, function: Callable, check: Callable[[Any, tuple], None]) -> Callable:
        """A function that the model has answered, looked at when it is called."""

        def called(*arguments):
            try:
                answer = function(*arguments)
                check(answer, arguments)
                return answer
            except Exception as error:
                raise self._told(error, f"{what}: ") from error

        return called

    def _told(self, error: Exception, place: str = "") -> ModelError:
        kind = "" if isinstance(error, Fault) else f"{type(error).__name__}: "
        return ModelError(f"{self.name}: {place}{kind}{error}")


def checked(model: Any, row: str, stage: StageOf, owner: str, antennas: int = 0) -> Checked:
    """A model under the checks of its stage; ModelError if it is none of that stage.

    owner     whose it is: "sky", "craft soyuz"
    antennas  of the craft; 0: it is of the sky
    """
    name = name_of(row, stage, owner)
    if not callable(getattr(model, stage.asks, None)):
        raise ModelError(f"{name}: {_said(model)} has no `{stage.asks}`, which this stage asks for")
    if stage is Stage.PATH and not isinstance(model, PathModel):
        raise ModelError(f"{name}: {_said(model)} is no PathModel, which this stage asks for")
    return Checked(model, name, stage, antennas)


def name_of(row: str, stage: StageOf, owner: str) -> str:
    """What errors call a model."""
    return f"error model '{row}' (stage {stage.name.upper()}, {owner})"


def _said(value: Any) -> str:
    return f"an array of shape {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__


def _is_a(value: Any, kind: type, what: str = "answers") -> None:
    if not isinstance(value, kind):
        raise Fault(f"{what} {_said(value)}; asked for is {kind.__name__}")


def finite(what: str, value: Any, shape: tuple[int, ...], *, one: bool = True, below: bool = False) -> None:
    """Fault if a value is not of numbers, not of a shape, or not finite.

    one    one number for all is of every shape
    below  it may be -inf
    """
    plain = type(value) is np.ndarray and value.dtype.char == "d" and value.shape == shape and value.ndim == 1
    if plain and math.isfinite(value.dot(value)):
        return  # the quick way, of most; what is too large to be squared goes the other
    if one and type(value) is float:
        right = math.isfinite(value) or (below and value == -math.inf)
    else:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise Fault(f"{what} is {_said(value)}; asked for are numbers")
        if array.shape != shape and not (one and array.shape == ()):
            raise Fault(f"{what} has shape {array.shape}; asked for is {shape}")
        right = np.isfinite(array).all() or (below and (array < np.inf).all())
    if not right:
        raise Fault(f"{what} is not finite")


def _clock(what: str, value: Any, shape: tuple[int, ...], seconds: Any) -> None:
    finite(what, value, shape, one=False)
    if np.any(np.abs(seconds(value)) > FURTHEST_S):
        raise Fault(f"{what} is more than {FURTHEST_S} s")


def _report(by: Checked, term: Any, at: Any) -> ReportTerm:
    _is_a(term, ReportTerm)
    shape = at.pos_ecef_m.shape
    finite("off_ecef_m", term.off_ecef_m, shape)
    finite("off_clock_m", term.off_clock_m, shape[:-1])
    return term


def _oscillator(by: Checked, term: Any, at: Any) -> Any:
    _clock("the clock", term, (at.count, 2, CLOCK_DOMAINS), lambda clocks: clocks[:, 0])
    return term


def _latch(by: Checked, term: Any, at: Any) -> Any:
    _clock("the latch's offset", term, (at.count,), lambda offset: offset)
    return term


def _attitude(by: Checked, term: Any, at: Any) -> AttitudeTerm:
    _is_a(term, AttitudeTerm)
    for part in fields(AttitudeTerm):
        finite(part.name, getattr(term, part.name), (at.count, 3), one=False)
    return term


def _link(by: Checked, term: Any, at: None) -> LinkTerm:
    _is_a(term, LinkTerm)
    for name, kind in (("transmitters", Transmit), ("antennas", Receive), ("jammers", Jammers)):
        if getattr(term, name) is not None:
            _is_a(getattr(term, name), kind, f"{name} is")
    if term.transmitters is not None:
        # A row of nan is of satellites of which nothing is known.
        known = ~np.isnan(term.transmitters.level_dbwm2).all(axis=1)
        _numbers("transmitters.level_dbwm2", term.transmitters.level_dbwm2[known])
    if term.antennas is not None:
        _numbers("antennas.right_dbi", term.antennas.right_dbi)
    if term.jammers is not None:
        _numbers("powers of jammers", np.concatenate((term.jammers.eirp_dbw, term.jammers.received_dbw)))
    if term.noise_wphz is not None:
        finite("noise_wphz", term.noise_wphz, (by.antennas,))
    if term.loss_db is not None:
        finite("loss_db", term.loss_db, ())
    return term


def _numbers(what: str, levels: Any) -> None:
    """Fault if levels, some of which may be -inf, are no numbers, or if there are none."""
    if not (np.size(levels) and (levels < np.inf).all()):
        raise Fault(f"{what} is not finite")


def _visibility(by: Checked, term: Any, at: Any) -> VisibilityTerm:
    _is_a(term, VisibilityTerm)

    def check(answer, arguments):
        array = np.asarray(answer)
        if array.dtype != bool or array.shape != arguments[0].shape:
            raise Fault(f"answers {_said(answer)}; asked for are booleans of shape {arguments[0].shape}")

    named = {name: getattr(term, name) for name in ("hides", "holds")}
    return replace(
        term, **{name: by.calling(name, rule, check) for name, rule in named.items() if rule is not None}
    )


def _path(by: Checked, term: Any, at: Any) -> PathTerm:
    _is_a(term, PathTerm)
    shape = (len(at),)
    finite("range_m", term.range_m, shape)
    finite("phase_m", term.phase_m, shape)
    finite("rate_mps", term.rate_mps, shape)
    if term.turns_cyc is not None:
        finite("turns_cyc", term.turns_cyc, shape, one=False)
    finite("level_db", term.level_db, shape, below=True)
    return term


def _tracking(by: Checked, term: Any, at: Any) -> TrackingTerm:
    _is_a(term, TrackingTerm)
    if term.half_cycles is not None and at is not None:
        _whole("half_cycles", term.half_cycles, (len(at),))
    if term.collection_ns is None:
        return term

    def check(answer, arguments):
        _whole("its answer", answer, np.broadcast_shapes(*(np.shape(part) for part in arguments)))

    return replace(term, collection_ns=by.calling("collection_ns", term.collection_ns, check))


def _whole(what: str, value: Any, shape: tuple[int, ...]) -> None:
    finite(what, value, shape, one=False)
    if np.asarray(value).dtype.kind == "f":
        raise Fault(f"{what} is not of whole numbers")


def _observable(by: Checked, term: Any, at: Any) -> ObservableTerm:
    _is_a(term, ObservableTerm)
    shape = (len(at.sat),)
    finite("range_m", term.range_m, shape)
    finite("phase_m", term.phase_m, shape)
    finite("rate_mps", term.rate_mps, shape)
    finite("level_db", term.level_db, shape)
    return term


def _frames(by: Checked, term: Any, at: Any) -> FrameBatch:
    _is_a(term, FrameBatch)
    if not len(term.t_ns) == len(term.can_id) == len(term.length) == len(term.data):
        raise Fault("columns of its frames differ in length")
    return term


_CHECKS: dict[StageOf, Callable[[Checked, Any, Any], Any]] = {
    Stage.BROADCAST: _report,
    Stage.OSCILLATOR: _oscillator,
    Stage.LATCH: _latch,
    Stage.ATTITUDE: _attitude,
    Stage.LINK: _link,
    Stage.VISIBILITY: _visibility,
    Stage.PATH: _path,
    Stage.TRACKING: _tracking,
    Stage.OBSERVABLE: _observable,
    Stage.FRAMES: _frames,
}
"""By stage: who answers, the answer, what was asked with -> the answer; Fault if it is none."""
