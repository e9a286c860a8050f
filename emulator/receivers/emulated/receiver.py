"""Emulated receivers of one craft, an epoch at a time: obey, choose, track, measure, send.

Commands sent in epoch k arrive here with epoch k + 1, act at once and are answered in this block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I8, I64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, WIDTH, FrameBatch
from gnss_hil.emulator.environment.block import Environment, build_block
from gnss_hil.emulator.environment.models import acting
from gnss_hil.emulator.error_models.base import Measured, Stage
from gnss_hil.emulator.numerics.chebyshev import Chunks
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import commands, phase, search
from gnss_hil.emulator.receivers.emulated.channels import FULL, Channels, advance, receivable, retarget
from gnss_hil.emulator.receivers.emulated.craft import Receivers, Unit, cold
from gnss_hil.emulator.receivers.emulated.prepared import Layout, Prepared
from gnss_hil.emulator.signal.bands import wavelength_m
from gnss_hil.emulator.signal.visibility import View

_EIGHTS = np.full(1 << 14, WIDTH, np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """Channels that measure in an epoch: their rows of the block, carrier phases (p,) [cycles] less
    ambiguities, and the ambiguities (p,) [cycles]."""

    layout: Layout
    cycles: F64
    ambiguity: F64


@dataclass(frozen=True, slots=True, eq=False)
class EmulatedCraft:
    """A craft whose receivers are emulated; see `gnss_hil.emulator.receivers.base`."""

    name: str
    environment: Environment
    receivers: Receivers
    blocks: Chunks[Prepared] = field(init=False)

    def __post_init__(self):
        keeps = bool(acting(self.environment.models, Stage.OBSERVABLE))
        object.__setattr__(
            self,
            "blocks",
            Chunks(
                lambda first: Prepared(
                    self.environment, self.receivers, build_block(self.environment, first), keeps
                )
            ),
        )

    @property
    def vehicle(self) -> Vehicle:
        return self.receivers.vehicle

    @property
    def codec(self) -> Codec:
        return self.receivers.codec

    @property
    def obeys(self) -> bool:
        return True

    def prepared(self, epoch: int) -> tuple[Prepared, int]:
        """The block of an epoch, and which of its epochs that is."""
        first = self.environment.span(epoch)[0]
        return self.blocks[first], epoch - first

    def fresh(self) -> Unit:
        models = self.environment.models
        stepped = len(acting(models, Stage.OBSERVABLE)) + len(acting(models, Stage.FRAMES))
        return cold(self.receivers, self.environment, stepped)

    def prepare(self, unit: Unit, epoch: int) -> None:
        """The epoch's block, and in it the signals that channels measure or search now."""
        prepared, _ = self.prepared(epoch)
        target = unit.channels.target
        receiver, channel = np.nonzero(target >= 0)
        if len(receiver):
            prepared.rows(receiver, target[receiver, channel])

    def step(self, unit: Unit, received: FrameBatch, epoch: int) -> tuple[Unit, FrameBatch, NDArray]:
        """One epoch: the next unit, its block of frames, and truth, a row of
        `gnss_hil.emulator.truth.TRUTH`."""
        prepared, k = self.prepared(epoch)
        block, receivers = prepared.block, self.receivers
        t_ns = int(block.geometry.t_ns[k])
        channels, counters, refused, answers = self._obey(prepared, k, unit, received, epoch)
        if not channels.commanded.all():
            channels = self._choose(prepared, k, channels)
        held = None if block.held is None else block.held[k]
        signal = receivable(channels, block.signal[k], held)
        channels, knowledge, begins = advance(
            channels, unit.knowledge, signal, receivers.pace, t_ns, self._collection()
        )
        tracked, channels = self._track(prepared, k, channels, begins, knowledge.warm)
        words, fits, states = self._measured(prepared, k, tracked, channels, unit, epoch)
        layout = tracked.layout
        if not fits.all():
            layout, words = _without(prepared, layout, channels, knowledge.warm, fits), words[fits]
        frames_out, sent = self._sent(prepared, k, layout, words, answers, unit, epoch)
        frames_out, states = self._disturbed(frames_out, states, epoch)
        unit = Unit(channels, knowledge, sent, counters, refused, states)
        return unit, frames_out, prepared.truth[k]

    def _choose(self, prepared: Prepared, k: int, channels: Channels) -> Channels:
        block, at = prepared.block, prepared.block.geometry
        view = View(*(getattr(at.view, name)[k] for name in View.__slots__))
        mark_ns = int(at.mark_ns[k])
        healthy = np.tile(at.sky.broadcast.healthy[k], self.environment.carriers.ranks)
        target = search.choose(
            self.receivers.rule, channels, block.signal[k] & healthy, view, at.sky.index,
            search.renews(mark_ns, self.environment.interval_ns),
        )  # fmt: skip
        return retarget(channels, channels.commanded, target, int(at.t_ns[k]))

    def _collection(self):
        """How long ephemerides of rows of the sky take to be collected."""
        time = self.receivers.collection_ns
        if time is None:
            return None
        system = satellites.system_of(self.environment.sky.sky.index)
        return lambda row, since_ns: time(system[row], since_ns)

    def _track(
        self, prepared: Prepared, k: int, channels: Channels, begins: Bool, warm: bool
    ) -> tuple[Tracked, Channels]:
        """Phases of the measuring channels, those left out whose values do not fit on the bus."""
        layout = prepared.layout(channels, warm)
        columns, rows = prepared.columns(), layout.base + k
        place = layout.receiver, layout.channel
        cycles, ambiguity, channels = phase.track(channels, begins, place, prepared.met(rows))
        whole = columns.whole[rows]
        if not whole.all():
            layout = prepared.layout(channels, warm, ~whole)
            cycles, ambiguity = cycles[whole], ambiguity[whole]
        return Tracked(layout, cycles, ambiguity), channels

    def _measured(
        self, prepared: Prepared, k: int, tracked: Tracked, channels: Channels, unit: Unit, epoch: int
    ):
        """(p, 10) words of the measurement frames; (p,) whether they hold all values; states of the models
        that disturb observables."""
        layout, cycles = tracked.layout, tracked.cycles
        columns, rows = prepared.columns(), layout.base + k
        slips = channels.slips[layout.receiver, layout.channel]
        templates = self.receivers.templates
        models = acting(self.environment.models, Stage.OBSERVABLE)
        words, fits = columns.words[rows], columns.whole[rows]
        states = list(unit.models)
        if models:
            assert columns.values is not None, "kept where models change them"
            values = dict(zip(templates.channel.names, columns.values[:, rows], strict=True))
            at = prepared.block.geometry
            seen = Measured(
                int(at.t_ns[k]),
                layout.receiver,
                layout.channel,
                at.sky.index[layout.row],
                columns.cn0_dbhz[rows],
                layout.signal,
            )
            for number, model in enumerate(models):
                states[number], term = model.step(states[number], seen, epoch)
                values["pseudorange_m"] = values["pseudorange_m"] + term.range_m
                values["range_rate_mps"] = values["range_rate_mps"] + term.rate_mps
                level = values["cn0_dbhz"] + term.level_db
                values["cn0_dbhz"] = np.minimum(level, frames.CN0_TOP_DBHZ)
                cycles = cycles + term.phase_m / self._wave_m(prepared, k, layout)
            data, carried = templates.channel.fill(len(rows), values)
            fits = np.logical_and.reduce(carried, axis=1)
            words = np.ascontiguousarray(data).view("<u8")[..., 0]
        words = words | layout.channel_bits
        words[:, templates.phase.frame] |= templates.phase.word(cycles, slips, tracked.ambiguity % 1 != 0)
        return words, fits, tuple(states)

    def _wave_m(self, prepared: Prepared, k: int, layout: Layout) -> F64:
        broadcast = prepared.block.geometry.sky.broadcast
        return wavelength_m(layout.signal, broadcast.frequency[k, layout.row])

    def _sent(
        self,
        prepared: Prepared,
        k: int,
        layout: Layout,
        words,
        answers: Sequence[frames.Part],
        unit: Unit,
        epoch: int,
    ) -> tuple[FrameBatch, I8]:
        """The epoch's frames, protected, and the counters of their streams."""
        templates, codec = self.receivers.templates, self.receivers.codec
        mark_ns = int(prepared.block.geometry.mark_ns[k])
        closing = prepared.closing[k] | layout.closing
        body = np.concatenate((words.reshape(-1), closing.reshape(-1))).take(layout.order)
        front, almanac = prepared.front[k], prepared.almanac[k]
        every = np.concatenate((front.words, body, almanac.words, templates.beat_words))
        can_id = np.concatenate((front.can_id, layout.can_id, almanac.can_id, templates.heartbeats.can_id))
        stream = np.concatenate((front.stream, layout.stream, almanac.stream, templates.beat_stream))
        head, tail = slice(len(front.words)), slice(len(front.words) + len(body), -len(templates.beat_words))
        rank = None
        if prepared.repeats:
            rank = np.zeros(len(every), np.int64)
            rank[head], rank[tail] = front.rank, almanac.rank
        if not (front.fits.all() and almanac.fits.all()):
            fits = np.ones(len(every), bool)
            fits[head], fits[tail] = front.fits, almanac.fits
            every, can_id, stream = every[fits], can_id[fits], stream[fits]
            rank = None if rank is None else rank[fits]
        if not answers:
            data, sent = e2e.protect_words(can_id, every, stream, rank, unit.sent, epoch)
            return FrameBatch(np.full(len(data), mark_ns), can_id, _EIGHTS[: len(data)], data), sent
        data = every.view(np.uint8).reshape(-1, WIDTH)
        marks = len(templates.mark.kinds)
        parts = (
            frames.Part(can_id[:marks], data[:marks]),
            *answers,
            frames.Part(can_id[marks:], data[marks:]),
        )
        return e2e.protect(codec, frames.block(parts, mark_ns), unit.sent, epoch)

    def _disturbed(self, block: FrameBatch, states: tuple, epoch: int) -> tuple[FrameBatch, tuple]:
        """The frames as models of the bus leave them."""
        models = acting(self.environment.models, Stage.FRAMES)
        if not models:
            return block, states
        kept = list(states)
        for number, model in enumerate(models, len(kept) - len(models)):
            kept[number], block = model.step(kept[number], block, epoch)
        return block, tuple(kept)

    def _obey(
        self, prepared: Prepared, k: int, unit: Unit, received: FrameBatch, epoch: int
    ) -> tuple[Channels, I8, I64, tuple[frames.Part, ...]]:
        """Obey the commands among the frames received.

        returns  channels, counters of the streams received, command frames rejected so far, answers to send
        A command that fails the checks of the bus is counted, not answered: what it asked for is not known.
        So is one that does not answer an epoch just past (MIXED_EPOCH), whose counter is not looked at: its
        sender has long decided otherwise.
        """
        receivers = self.receivers
        codec = receivers.codec
        kind = codec.kind_of[received.can_id & SFF_MASK]
        mine = received[kind == codec.kinds["COMMAND"].number]
        if not len(mine):
            return unit.channels, unit.received, unit.refused, ()
        sound = screening.checked(codec, mine)
        timely = sound.refusing(~commands.timely(mine, epoch), screening.Verdict.MIXED_EPOCH)
        checked = screening.sequenced(mine, timely, unit.received)
        refused = unit.refused + np.bincount(checked.verdict, minlength=len(screening.Verdict))
        refused[[screening.Verdict.OK, screening.Verdict.LOST]] = 0
        orders = commands.read(codec, checked.frames)
        # A unit that knows neither time nor place cannot judge what the Earth hides: it accepts, and
        # searches in vain.
        in_sight = prepared.block.in_sight[k] | (not unit.knowledge.warm)
        at = prepared.block.geometry
        prospects = commands.Prospects(
            receivers.row_of, at.sky.broadcast.available[k], at.sky.broadcast.healthy[k], in_sight,
            self.environment.carriers,
        )  # fmt: skip
        channels, result = commands.obey(
            unit.channels, orders, receivers.vehicle.channels, prospects, int(at.t_ns[k])
        )
        answers = (frames.answers_part(receivers.templates, orders, result),) if len(orders) else ()
        return channels, checked.counters, refused, answers


def _without(prepared: Prepared, layout: Layout, channels: Channels, warm: bool, fits: Bool) -> Layout:
    """The layout of those of its channels whose values fit, (p,)."""
    stays = np.zeros(channels.lock.shape, bool)
    stays[layout.receiver[fits], layout.channel[fits]] = True
    return prepared.layout(channels, warm, ~stays[channels.lock == FULL])
