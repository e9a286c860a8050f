"""Error models at work on one craft, by the stage in which they act, and how their terms join."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.emulator.error_models.base import (
    AttitudeTerm,
    Epochs,
    LinkTerm,
    PathModel,
    PathTerm,
    Stage,
    StageOf,
    TrackingTerm,
    VisibilityTerm,
)
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry

Models = Mapping[StageOf, tuple[Any, ...]]
"""Of one craft, the sky's among them, in the registry's order."""

Model = TypeVar("Model")


def acting(models: Models, stage: StageOf[Model]) -> tuple[Model, ...]:
    """The models of a stage."""
    return models.get(stage, ())


class Clash(ValueError):
    """Two models of a craft that cannot both be; the message is for people."""


def only(models: Models, stage: StageOf[Model]) -> Model | None:
    """The model of a stage that has room for one."""
    found = acting(models, stage)
    if len(found) > 1:
        raise Clash(f"two models of stage {stage.name}; there is room for one")
    return found[0] if found else None


def ahead_s(models: Models, epochs: Epochs) -> F64:
    """(k,) mark minus latch [s] of marks that the on-board computer reads from its own clock."""
    return sum((model.block(epochs) for model in acting(models, Stage.LATCH)), np.zeros(epochs.count))


def attitude(models: Models, epochs: Epochs) -> AttitudeTerm | None:
    """What the reported attitude is off; None: nothing."""
    terms = [model.block(epochs) for model in acting(models, Stage.ATTITUDE)]
    if not terms:
        return None
    first, *others = terms
    return AttitudeTerm(
        sum((term.angle_rad for term in others), first.angle_rad),
        sum((term.rate_rps for term in others), first.rate_rps),
    )


def link(models: Models) -> LinkTerm | None:
    """The parts of the link budget that models give; None: no model gives any."""
    terms = [model.block(None) for model in acting(models, Stage.LINK)]
    if not terms:
        return None
    given = [(f.name, getattr(term, f.name)) for term in terms for f in fields(LinkTerm)]
    given = [(name, value) for name, value in given if value is not None]
    twice = sorted({name for name, _ in given if sum(name == other for other, _ in given) > 1})
    if twice:
        raise Clash(f"two models of stage link give {', '.join(twice)}")
    return LinkTerm(**dict(given))


def visibility(models: Models, at: EpochGeometry) -> tuple[VisibilityTerm, ...]:
    return tuple(model.block(at) for model in acting(models, Stage.VISIBILITY))


def hidden(terms: Iterable[VisibilityTerm], candidate: Bool) -> Bool:
    """(k, m, n) candidates whose direct ray something hides."""
    out = np.zeros_like(candidate)
    for term in terms:
        if term.hides is not None:
            out |= term.hides(candidate)
    return out


def held(terms: Iterable[VisibilityTerm], in_field: Bool, cn0_dbhz: F64) -> Bool | None:
    """(k, m, n) signals that loops hold once they have them; None: those that can be found."""
    rules = [term.holds for term in terms if term.holds is not None]
    if not rules:
        return None
    out = in_field.copy()
    for holds in rules:
        out &= holds(cn0_dbhz)
    return out


NONE = PathTerm()


@dataclass(frozen=True, slots=True, eq=False)
class PathModels:
    """Models of the stage PATH: those that lead, and the others."""

    leading: tuple[PathModel, ...]
    following: tuple[PathModel, ...]

    def led(self, at: ChannelGeometry) -> PathTerm:
        return sum((model.block(at) for model in self.leading), NONE)

    def followed(self, at: ChannelGeometry) -> PathTerm:
        return sum((model.block(at) for model in self.following), NONE)

    def reaching(self, at: ChannelGeometry) -> F64:
        """(p,) level [dB] at which signals arrive whose direct ray is hidden; -inf: not at all."""
        levels = [
            np.broadcast_to(model.block(at).level_db, len(at)) for model in self.leading if model.reaches
        ]
        return np.max(levels, axis=0) if levels else np.full(len(at), -np.inf)


def path_models(models: Models) -> PathModels:
    every = acting(models, Stage.PATH)
    return PathModels(tuple(m for m in every if m.leads), tuple(m for m in every if not m.leads))


def tracking(models: Models, at: ChannelGeometry | None) -> TrackingTerm:
    """How channels track: slips of signals, or, without any, what holds for all of a run."""
    terms = [model.block(at) for model in acting(models, Stage.TRACKING)]
    slips = [term.half_cycles for term in terms if term.half_cycles is not None]
    timed = [term for term in terms if term.collection_ns is not None]
    if len(timed) > 1:
        raise Clash("two models of stage tracking time the collection of ephemerides")
    return TrackingTerm(
        sum(slips[1:], slips[0]) if slips else None,
        timed[0].collection_ns if timed else None,
        all(term.shared for term in terms),
    )


Clocks = Callable[[Epochs], F64]
"""Receiver clocks (k, 2, 8) of epochs: minus GPS time [s], and their rates [s/s]."""
