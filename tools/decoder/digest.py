"""What a bus amounts to: its epochs, fixes, channels, commands, almanac, clocks; built while frames pass."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.decoder.almanac import AlmanacLog
from gnss_hil.tools.decoder.block import Block, Columns, GrowingTable
from gnss_hil.tools.decoder.channels import Channels, channels_of, lists_used, used_in_fix
from gnss_hil.tools.decoder.command_log import CommandLog
from gnss_hil.tools.decoder.counters import Counters
from gnss_hil.tools.decoder.decoder import Decoder
from gnss_hil.tools.decoder.dilution import distinct_pdop, distinct_satellites, paired_satellites
from gnss_hil.tools.decoder.doubted_times import Reckoning, settled
from gnss_hil.tools.decoder.flight_checks import lacks_said, left_out, named, refusals_said
from gnss_hil.tools.decoder.navigation import attitudes, fixes
from gnss_hil.tools.decoder.nodes import Nodes
from gnss_hil.tools.decoder.time_marks import mark_times_ns

_CARRIER_HZ: F64 = signals.column(lambda signal: signal.carrier_hz, 0.0)


class Digest:
    """The digest of one bus, frames fed in bus order in pieces of any size.

    on_channels  is handed the channel table piece by piece (it is large); `used` where `used_told`: a fix
                 without a NAV_USED does not say
    tags         one row per TAG at a known time: t_ns, receiver (1-based), tag_offset_ns, clock_domain
    nodes        which fell silent, which started again
    """

    def __init__(self, codec: Codec, on_channels: Callable[[Columns], None] | None = None):
        self._decoder = Decoder(codec, self._take)
        self._on_channels = on_channels
        self._marks = GrowingTable()
        self._fixes = GrowingTable()
        self.commands = CommandLog()
        self.almanac = AlmanacLog()
        self.tags = GrowingTable()
        self.nodes = Nodes(codec)
        self._epochs_taken = 0
        self._reckoning = Reckoning()
        self._said = GrowingTable()
        self._left_out = GrowingTable()
        self._lacks = GrowingTable()
        self._unhealthy = GrowingTable()

    def feed(self, frames: FrameBatch, bits: I64 | None = None) -> None:
        """More frames (n,), and their bits (n,) on the wire if they are known already."""
        self._decoder.feed(frames, bits)

    def finish(self) -> None:
        """Decode what is still held. Of a bus without an epoch the tables have their columns and no rows."""
        self._decoder.finish()
        if not self._decoder.epochs:
            none = np.zeros(0, np.int64)
            self._take(Block(self._decoder.codec, none, none.astype(np.uint64), none, 0), none, none)

    def _take(self, block: Block, bits: I64, faults: I64) -> None:
        number = block.grid("TIME_MARK", "epoch", -1).astype(np.int64)
        t_ns, self._reckoning = settled(
            block, mark_times_ns(block), number, self._doubted(block.epochs), self._reckoning
        )
        known = t_ns >= 0
        channels = channels_of(block)
        navigation = fixes(block)
        used = used_in_fix(block)[channels.epoch, channels.receiver, channels.channel]
        used &= navigation["valid"][channels.epoch]
        told = lists_used(block) | ~navigation["valid"]
        navigation |= _distinct(block, channels, used, told, navigation)
        out = left_out(channels, used, told, navigation)
        navigation["excluded"] = named(out, block.epochs)
        self._take_flight_checks(block, channels, used, out)
        reported = navigation.pop("reported") & known
        own = {"t_ns": t_ns[reported], "epoch": number[reported]}
        self._fixes.add({**own, **{k: v[reported] for k, v in navigation.items()}})
        measured = distinct_satellites(channels.epoch, channels.sat, block.epochs)
        marks = {"t_ns": t_ns, "epoch": number}
        marks |= {"bits": bits, "faults": faults, "satellites_measured": measured}
        self._marks.add({**marks, **attitudes(block)})
        self.commands.take(t_ns, block)
        self.almanac.take(t_ns, block)
        self.tags.add(_tags(t_ns, block))
        self.nodes.take(block)
        if self._on_channels is not None:
            row = slice(None) if known.all() else known[channels.epoch]
            table = {"t_ns": t_ns[channels.epoch], "receiver": channels.receiver + 1}
            table |= {"channel": channels.channel, "sat": channels.sat, "used": used}
            table |= {"used_told": told[channels.epoch], **channels.values}
            self._on_channels({name: column[row] for name, column in table.items()})

    def _doubted(self, epochs: int) -> Columns:
        """Time frames that counters have refused in the next so many epochs."""
        found = self._decoder.doubted.rows or {
            name: np.zeros(0, np.int64) for name in ("epoch", "kind", "word")
        }
        row = found["epoch"] - self._epochs_taken
        mine = (row >= 0) & (row < epochs)
        return {"epoch": row[mine], "kind": found["kind"][mine], "word": found["word"][mine]}

    def _take_flight_checks(self, block: Block, channels: Channels, used: Bool, out: Columns) -> None:
        """Of a block's epochs, behind those before it."""
        before = self._epochs_taken
        shy = (channels.values["health"] != 0) & ~used
        for table, rows in (
            (self._said, refusals_said(block)),
            (self._left_out, out),
            (self._lacks, lacks_said(block)),
            (self._unhealthy, {"epoch": channels.epoch[shy], "sat": channels.sat[shy]}),
        ):
            table.add({"row": before + rows["epoch"], **{k: v for k, v in rows.items() if k != "epoch"}})
        self._epochs_taken += block.epochs

    @property
    def said(self) -> dict[str, NDArray]:
        """What the flight software refused by its own word: row (of `marks`), reason (raw), identifier,
        count."""
        return self._said.rows

    @property
    def lacks(self) -> dict[str, NDArray]:
        """What it says that it does without: row (of `marks`), which (place in `flight_checks.LACKS`)."""
        return self._lacks.rows

    @property
    def left_out(self) -> dict[str, NDArray]:
        """Satellites and receivers that it left out of fixes: row (of `marks`), receiver (whether it is one),
        which (satellite index, or 0-based number; `flight_checks.UNNAMED`), count."""
        return self._left_out.rows

    @property
    def unhealthy(self) -> dict[str, NDArray]:
        """Channels that measured a satellite which says it is unhealthy and are not in the fix: row (of
        `marks`), sat."""
        return self._unhealthy.rows

    @property
    def fixes(self) -> dict[str, NDArray]:
        """One row per NAV_STATUS: t_ns, epoch (as its mark says), valid, x_m ... vz_mps, clock_bias_m, mode,
        no_fix, satellites, measurements, pdop, tested, excluded_satellites, excluded_receivers,
        sigma_x_m .. rho_vyz, clock_drift_mps, sigma_clock_bias_m, sigma_clock_drift_mps and clock_domain, the
        lowest of the fix, which these are of, as the flight software reports them; satellites_used,
        satellites_paired, pdop_distinct, nan for a fix without NAV_USED, and excluded, names of what was, as
        computed here."""
        return self._fixes.rows

    @property
    def timeline(self) -> dict[str, NDArray]:
        """One row per time mark with an instant: t_ns, epoch (as it says), bits, faults (frames rejected),
        satellites_measured (different ones that receivers delivered whole), and the attitude and rates on the
        bus, q0 .. q3 and wx_rps .. wz_rps, nan where their frames are missing."""
        marks = self._marks.rows
        return {name: values[marks["t_ns"] >= 0] for name, values in marks.items()}

    @property
    def marks(self) -> dict[str, NDArray]:
        """Of every time mark, those without an instant too: t_ns (-1 there), epoch (as it says)."""
        rows = self._marks.rows
        return {name: rows.get(name, np.zeros(0, np.int64)) for name in ("t_ns", "epoch")}

    @property
    def refused(self) -> dict[str, NDArray]:
        """After `finish`, what each check of the protection saw: row (of `marks`, -1 before the first),
        reason (its place in `refusals.REASONS`), can_id, frames."""
        rows = self._decoder.refusals.rows
        return {"row": rows.pop("epoch"), **rows}

    @property
    def unmarked(self) -> dict[str, NDArray]:
        """Epochs whose mark is missing, by frames that name them: row (of `marks`, the mark before), ahead
        (by how many epochs), senders (how many nodes sent such frames)."""
        found = self._decoder.unmarked.rows
        if not found:
            return {name: np.zeros(0, np.int64) for name in ("row", "ahead", "senders")}
        sender = np.array(self.codec.sender_of)[found["can_id"]]
        _, node = np.unique(sender, return_inverse=True)
        pairs = np.unique(np.stack([found["epoch"], found["ahead"], node]), axis=1)
        (row, ahead), senders = np.unique(pairs[:2], axis=1, return_counts=True)
        return {"row": row, "ahead": ahead, "senders": senders}

    @property
    def codec(self) -> Codec:
        return self._decoder.codec

    @property
    def epochs(self) -> int:
        """Time marks heard."""
        return self._decoder.epochs

    @property
    def counters(self) -> Counters:
        return self._decoder.counters

    @property
    def bits(self) -> I64:
        """(epochs,) bits on the wire, of every time mark."""
        return self._marks.rows.get("bits", np.zeros(0, np.int64))


def _distinct(block: Block, channels: Channels, used: Bool, told: Bool, fix: Columns) -> dict[str, NDArray]:
    """Satellites in the fix of each epoch, those of them by two carriers, and their PDOP, (e,) each, by the
    channels (k,) used in it; nan where that is not told (e,)."""
    epoch, sat, receiver = channels.epoch[used], channels.sat[used], channels.receiver[used]
    domain = block.grid("TAG", "clock_domain", 0)[epoch, receiver]
    carrier_hz = _CARRIER_HZ[channels.values["signal"][used].astype(np.int64)]
    craft_m = np.stack([fix[f"{axis}_m"] for axis in "xyz"], axis=-1)
    los_m = channels.position_m[used] - craft_m[epoch]
    distinct = distinct_satellites(epoch, sat, block.epochs)
    paired = paired_satellites(epoch, receiver, sat, carrier_hz, block.epochs)
    return {
        "satellites_used": np.where(told, distinct, np.nan),
        "satellites_paired": np.where(told, paired, np.nan),
        "pdop_distinct": distinct_pdop(epoch, sat, domain, los_m, block.epochs),
    }


def _tags(t_ns: I64, block: Block) -> Columns:
    """What each receiver's own clock showed at the marks t_ns (e,), and which oscillator it runs on."""
    tags = block["TAG"]
    columns = {"t_ns": t_ns[tags.epoch], "receiver": tags.number}
    columns |= {name: tags[name].astype(np.int64) for name in ("tag_offset_ns", "clock_domain")}
    return {name: values[columns["t_ns"] >= 0] for name, values in columns.items()}
