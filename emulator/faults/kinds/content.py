"""Frames that carry something else, and headers that are not theirs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from gnss_hil.dbc.contract.messages import HEADER_NAMES
from gnss_hil.emulator.faults import signals
from gnss_hil.emulator.faults.alter import Alter, Flipped, Frozen, Noise, Same, Shorten, payload_bits
from gnss_hil.emulator.faults.base import Actions
from gnss_hil.emulator.faults.kinds.row import LINKS, Bus, Row, sides
from gnss_hil.emulator.faults.models import Altering, Placed
from gnss_hil.emulator.faults.protect import Protection, Way
from gnss_hil.emulator.faults.signals import Change
from gnss_hil.emulator.faults.spoken import OneOrMore
from gnss_hil.emulator.faults.where import Where


class Masquerade(Altering):
    """Signals that are not the sender's under a CRC that is valid: nothing on the bus tells.

    change   signals and what becomes of them: "RANGE.pseudorange_m += 30", or tables
    """

    kind: Literal["masquerade"]
    change: Annotated[tuple[Change, ...], OneOrMore(), Field(min_length=1)]


class Corruption(Placed):
    """Bits turned over on the way, under the CRC of the true payload.

    bits         so many of the 64, header included, drawn for each frame
    flip         instead: these, in 16 hexadecimal digits, byte 0 first
    protection   keep: the CRC cannot fit, but by chance
    """

    kind: Literal["corruption"]
    bits: Annotated[int, Field(ge=1, le=64)] = 1
    flip: Annotated[str, Field(pattern=r"^[0-9A-Fa-f]{16}$")] | None = None
    protection: Protection = Protection(crc="keep")

    @model_validator(mode="after")
    def _flips(self):
        if self.flip is not None and not int(self.flip, 16):
            raise ValueError("flip: turns no bit over")
        return self


class Length(Placed):
    """Frames of another length.

    length   in bytes; the others are lost
    """

    kind: Literal["length"]
    length: Annotated[int, Field(ge=0, le=7)] = 4


class Stuck(Altering, Placed):
    """Payloads that stay as they were in the window's first epoch, under a live counter and a valid CRC.

    signals   only these, by name; all of them without
    """

    kind: Literal["stuck"]
    signals: Annotated[tuple[str, ...], OneOrMore()] = ()

    @model_validator(mode="after")
    def _not_of_the_header(self):
        header = HEADER_NAMES.intersection(self.signals)
        if header:
            raise ValueError(
                f"signals: {', '.join(sorted(header))} is the protection's: kinds counter and crc"
            )
        return self


class Garbage(Altering, Placed):
    """Payloads of anything under a valid CRC, anew in each frame; keys of streams (channels) stay."""

    kind: Literal["garbage"]


class Counter(Placed):
    """Counters that are not the sender's, under a valid CRC.

    way     value, freeze, random, offset, wrong
    by      the value or the offset
    after   the counter behind the fault: correct; last-valid: one on from the last before it; last-value: one
            on from the last in it
    """

    kind: Literal["counter"]
    way: Literal["value", "freeze", "random", "offset", "wrong"] = "freeze"
    by: Annotated[int, Field(ge=0, le=15)] = 0
    after: Literal["correct", "last-valid", "last-value"] = "correct"

    @model_validator(mode="after")
    def _moves(self):
        return _offset_by_something(self)


class Crc(Placed):
    """CRCs that do not fit the payload.

    way   wrong: never; value, freeze, random, offset: by chance
    by    the value or the offset
    """

    kind: Literal["crc"]
    way: Way = "wrong"
    by: Annotated[int, Field(ge=0, le=255)] = 0

    @model_validator(mode="after")
    def _moves(self):
        return _offset_by_something(self)


def _offset_by_something(p: Any) -> Any:
    if p.way == "offset" and p.by == 0:
        raise ValueError("by: an offset of 0 changes nothing")
    return p


def _masquerade(p: Masquerade, bus: Bus, where: Where) -> Actions:
    content = signals.changed(p.change, bus.codec, where.identifiers)
    return sides(bus, where, Alter(bus.codec, content, p.protection))


def _corruption(p: Corruption, bus: Bus, where: Where) -> Actions:
    mask = None if p.flip is None else int.from_bytes(bytes.fromhex(p.flip), "little")
    return sides(bus, where, Alter(bus.codec, Flipped(p.bits, mask), p.protection))


def _stuck(p: Stuck, bus: Bus, where: Where) -> Actions:
    if not p.signals:
        content = Frozen(payload_bits(bus.codec))
    else:
        changes = [Change(signal=name, freeze=True) for name in p.signals]
        content = signals.changed(changes, bus.codec, where.identifiers)
    return sides(bus, where, Alter(bus.codec, content, p.protection, only_changed=False))


def _garbage(p: Garbage, bus: Bus, where: Where) -> Actions:
    return sides(bus, where, Alter(bus.codec, Noise(payload_bits(bus.codec)), p.protection))


def _header(bus: Bus, where: Where, how: Protection) -> Actions:
    return sides(bus, where, Alter(bus.codec, Same(), how, only_changed=False))


ROWS = (
    Row("masquerade", Masquerade, "signals that are not the sender's, under a valid CRC", _masquerade,
        "rx1 ch0 RANGE.pseudorange_m += 30 @30+10", first="change", links=LINKS,
        touches=lambda p: tuple({kind.name: kind for one in p.change for kind in one.kinds()}),
        detail="A change alone makes a one-liner a masquerade: `ATT_Q01.q0 freeze @30+10`."),
    Row("corruption", Corruption, "bits turned over on the way, under the CRC of the true payload",
        _corruption, "rx1 corruption 2 @30+10", words=("corrupt", "flip"), first="bits", links=LINKS),
    Row("length", Length, "frames of another length",
        lambda p, bus, where: sides(bus, where, Shorten(p.length)),
        "rx1 RANGE length 4 @30+10", words=("shorten",), first="length", links=LINKS),
    Row("stuck", Stuck, "payloads that stay, under a live counter and a valid CRC", _stuck,
        "ATT stuck @30+10", words=("freeze", "frozen")),
    Row("garbage", Garbage, "payloads of anything, under a valid CRC", _garbage,
        "ATT garbage @30+10"),
    Row("counter", Counter, "counters that are frozen, drawn, set or shifted",
        lambda p, bus, where: _header(
            bus, where, Protection(counter=p.way, counter_by=p.by, after=p.after)),
        "rx2 counter freeze @30+10 after=last-value", first="way"),
    Row("crc", Crc, "CRCs that do not fit",
        lambda p, bus, where: _header(bus, where, Protection(crc=p.way, crc_by=p.by)),
        "rx2 crc wrong @30+10", first="way", links=LINKS),
)  # fmt: skip
