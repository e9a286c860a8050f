"""ASAM MDF 4 (.mf4) through asammdf, an extra: bus logging as the standard names its channels.

Written whole pieces at a time; python-can's writer appends frame by frame.
"""

from __future__ import annotations

import gc
import logging
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, WIDTH
from gnss_hil.tools.common.errors import Missing
from gnss_hil.tools.recording.formats.piece import LogError, Piece

HINT = "MF4 needs the package asammdf: pip install 'gnss-hil[mf4]'"

_COMMON = (("BusChannel", "<u1"), ("ID", "<u4"), ("IDE", "<u1"), ("DLC", "<u1"), ("DataLength", "<u1"))
_PAYLOAD = (("DataBytes", f"({WIDTH},)u1"),)
_FLAGS = (("Dir", "<u1"), ("EDL", "<u1"), ("BRS", "<u1"), ("ESI", "<u1"))
_GROUPS = {
    "CAN_DataFrame": _COMMON + _PAYLOAD + _FLAGS,
    "CAN_ErrorFrame": _COMMON + _PAYLOAD + _FLAGS,
    "CAN_RemoteFrame": _COMMON + _FLAGS[:1],
}
_SECOND_US = 1_000_000


def require() -> None:
    """Missing if asammdf is not installed; without its chatter if it is."""
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    try:
        import asammdf  # noqa: F401
    except ImportError:
        raise Missing(HINT) from None


def open_reader(path: Path):
    """python-can's reader. What asammdf leaves of a damaged file complains on stderr when it is collected."""
    require()
    hook, sys.unraisablehook = sys.unraisablehook, lambda unraisable: None
    try:
        reader, fault = _attempt(path)
        if fault:
            gc.collect()
    finally:
        sys.unraisablehook = hook
    if reader is None:
        raise LogError(f"{path}: not ASAM MDF 4, or damaged: {fault}")
    return reader


def _attempt(path: Path):
    """A reader and "", or None and why there is none."""
    import can

    try:
        return can.MF4Reader(path), ""
    except OSError:
        raise
    except Exception as error:  # a foreign parser on an untrusted file
        return None, " ".join(str(error).split()) or type(error).__name__


class Mf4Writer:
    """channels  number of each bus, from 0, as python-can has them."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        require()
        from asammdf import MDF

        path.touch()  # what cannot be written is an error now, not at the end
        self._path = path
        self._channels = channels
        self._mdf = MDF(version="4.10")
        self._start_us: int | None = None

    def _begin(self, unix_us: int) -> int:
        from asammdf import Signal
        from asammdf.blocks.v4_blocks import SourceInformation
        from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS

        self._start_us = start_us = unix_us // _SECOND_US * _SECOND_US
        self._mdf.header.start_time = datetime.fromtimestamp(start_us / _SECOND_US, UTC)
        for name, fields in _GROUPS.items():
            samples = np.empty(0, [(f"{name}.{field}", kind) for field, kind in fields])
            source = SourceInformation(source_type=SOURCE_BUS, bus_type=BUS_TYPE_CAN)
            self._mdf.append(Signal(name=name, samples=samples, timestamps=np.empty(0), source=source))
        return start_us

    def write(self, piece: Piece) -> None:
        unix_us, bus, frames, sent = piece
        if not len(frames):
            return
        start_us = self._begin(int(unix_us[0])) if self._start_us is None else self._start_us
        elapsed_s = (unix_us - start_us) / _SECOND_US
        error, remote = frames.can_id & ERR_FLAG != 0, frames.can_id & RTR_FLAG != 0
        names, number = np.unique(bus, return_inverse=True)
        values = {
            "BusChannel": np.array([self._channels[name] for name in names.tolist()])[number],
            "ID": frames.can_id & EFF_MASK,
            "IDE": frames.can_id & EFF_FLAG != 0,
            "DLC": frames.length,
            "DataLength": frames.length,
            "DataBytes": frames.data,
            "Dir": sent,
        }
        for group, mine in enumerate((~error & ~remote, error, remote & ~error)):
            if mine.any():
                self._extend(group, elapsed_s[mine], {name: v[mine] for name, v in values.items()})

    def _extend(self, group: int, elapsed_s: np.ndarray, values: Mapping[str, np.ndarray]) -> None:
        name, fields = list(_GROUPS.items())[group]
        samples = np.zeros(len(elapsed_s), [(f"{name}.{field}", kind) for field, kind in fields])
        for field, _ in fields:
            if field in values:
                samples[f"{name}.{field}"] = values[field]
        self._mdf.extend(group, [(elapsed_s, None), (samples, None)])

    def close(self) -> None:
        if self._start_us is None:
            self._begin(0)
        with self._mdf:
            self._mdf.save(self._path, overwrite=True, compression=1)
