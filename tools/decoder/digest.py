"""What a bus amounts to: its epochs, fixes, channels, commands, almanac, clocks; built while frames pass."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.decoder.almanac import AlmanacLog
from gnss_hil.tools.decoder.block import Block
from gnss_hil.tools.decoder.channels import channels_of, clock_domains, used_in_fix
from gnss_hil.tools.decoder.command_log import CommandLog
from gnss_hil.tools.decoder.counters import Counters
from gnss_hil.tools.decoder.decoder import Decoder
from gnss_hil.tools.decoder.dilution import distinct_pdop, distinct_satellites
from gnss_hil.tools.decoder.navigation import attitudes, fixes, mark_times_ns
from gnss_hil.tools.decoder.receiver_tags import TagLog

Columns = Mapping[str, NDArray]


class Digest:
    """The digest of one bus, frames fed in bus order in pieces of any size.

    on_channels   is handed the channel table piece by piece (it is large)
    """

    def __init__(self, codec: Codec, on_channels: Callable[[Columns], None] | None = None):
        self._decoder = Decoder(codec, self._take)
        self._on_channels = on_channels
        self._epochs: list[Columns] = []
        self._fixes: list[Columns] = []
        self.commands = CommandLog()
        self.almanac = AlmanacLog()
        self.tags = TagLog()

    def feed(self, frames: FrameBatch, bits: I64 | None = None) -> None:
        """More frames (n,), and their bits (n,) on the wire if they are known already."""
        self._decoder.feed(frames, bits)

    def finish(self) -> None:
        """Decode what is still held."""
        self._decoder.finish()

    def _take(self, block: Block) -> None:
        t_ns = mark_times_ns(block)
        known = t_ns >= 0
        channels = channels_of(block)
        navigation = fixes(block)
        epoch, receiver, sat = channels.epoch, channels.receiver, channels.sat
        used = used_in_fix(block)[epoch, receiver, channels.channel] & navigation["valid"][epoch]
        craft_m = np.stack([navigation[f"{axis}_m"] for axis in "xyz"], axis=-1)
        epoch, sat = epoch[used], sat[used]
        navigation["satellites_used"] = distinct_satellites(epoch, sat, block.epochs)
        navigation["pdop_distinct"] = distinct_pdop(
            epoch,
            sat,
            clock_domains(block)[epoch, receiver[used]],
            channels.position_m[used] - craft_m[epoch],
            block.epochs,
        )
        reported = navigation.pop("reported") & known
        self._fixes.append({"t_ns": t_ns[reported], **{k: v[reported] for k, v in navigation.items()}})
        self._epochs.append({"t_ns": t_ns, **attitudes(block)})
        self.commands.take(t_ns, block)
        self.almanac.take(t_ns, block)
        self.tags.take(t_ns, block)
        if self._on_channels is not None:
            row = slice(None) if known.all() else known[channels.epoch]
            table = {"t_ns": t_ns[channels.epoch], "receiver": channels.receiver + 1}
            table |= {"channel": channels.channel, "sat": channels.sat, "used": used, **channels.values}
            self._on_channels({name: column[row] for name, column in table.items()})

    @property
    def fixes(self) -> dict[str, NDArray]:
        """One row per NAV_STATUS: t_ns, valid, x_m ... vz_mps, clock_bias_m, mode, no_fix, satellites,
        measurements, pdop, sigma_x_m .. rho_yz as the flight software reports them; satellites_used,
        pdop_distinct as computed here."""
        return _joined(self._fixes)

    @property
    def timeline(self) -> dict[str, NDArray]:
        """One row per time mark with an instant: t_ns, bits, faults (frames rejected), and the attitude and
        rates on the bus, q0 .. q3 and wx_rps .. wz_rps, nan where their frames are missing."""
        table = _joined(self._epochs)
        if not table:
            return {}
        known = table["t_ns"] >= 0
        epochs = len(known)
        counts = {"bits": self._decoder.bits[:epochs], "faults": self._decoder.faults[:epochs]}
        return {name: values[known] for name, values in (table | counts).items()}

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
        return self._decoder.bits


def _joined(pieces: list[Columns]) -> dict[str, NDArray]:
    """One table of its pieces; empty if there is none."""
    return {name: np.concatenate([p[name] for p in pieces]) for name in pieces[0]} if pieces else {}
