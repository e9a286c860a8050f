"""From one format to another, piece by piece."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.common.whole_file import draft_of
from gnss_hil.tools.recording.formats.order import in_time_order
from gnss_hil.tools.recording.formats.piece import Findings, Piece, kinds
from gnss_hil.tools.recording.formats.recording import Channels, Recording, format_of, open_writer


@dataclass(slots=True)
class Converted:
    """frames   written
    kinds    of them, those that are not of data
    found    besides, in the input
    strayed  by reason: frames that are there, but not where they should be
    renamed  buses that come back under another name
    """

    frames: int = 0
    kinds: Counter[str] = field(default_factory=Counter)
    found: Findings = field(default_factory=Findings)
    strayed: Counter[str] = field(default_factory=Counter)
    renamed: dict[str, str] = field(default_factory=dict)

    def add(self, piece: Piece) -> None:
        """Count what has been read and written."""
        self.frames += len(piece.frames)
        self.kinds += kinds(piece.frames)

    @property
    def summary(self) -> str:
        """How many frames there are, of which kinds, and how many are not."""
        among = [so_many(count, f"{kind} frame") for kind, count in sorted(self.kinds.items())]
        left = [f"{count} {why} left out" for why, count in sorted((+self.found.omitted).items())]
        return ", ".join([
            so_many(self.frames, "frame"), *(f"{part} among them" for part in among), *left
        ])  # fmt: skip

    def remarks(self, source: Path, out: Path) -> list[str]:
        """What is not in the new file as it was in the old one, in lines."""
        return [
            *self.found.lines(source),
            *(f"{source}: {so_many(count, 'frame')} {reason}" for reason, count in self.strayed.items()),
            *(f"{out}: bus {name} comes back as {other}" for name, other in self.renamed.items()),
        ]


def convert(
    recording: Recording, out: Path, progress: Callable[[int, float | None], None] = lambda n, share: None
) -> Converted:
    """Write a recording in the format of `out`'s suffix; `out` is there whole or not at all.

    progress  is given frames so far and the share of the input that they are
    """
    kind = format_of(out)
    done, channels = Converted(), Channels()
    pieces = recording.pieces()
    if not kind.named:
        pieces = in_time_order(pieces, done.strayed)
    with draft_of(out) as draft:
        writer = open_writer(draft, kind, channels)
        try:
            for piece in pieces:
                writer.write(piece)
                done.add(piece)
                progress(done.frames, recording.found.share)
        finally:
            writer.close()
    done.found = recording.found
    if not kind.named:
        done.renamed = channels.renamed
    return done
