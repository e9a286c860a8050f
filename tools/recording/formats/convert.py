"""From one format to another, piece by piece."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from gnss_hil.tools.common.whole_file import draft_of
from gnss_hil.tools.recording.formats.order import in_time_order
from gnss_hil.tools.recording.formats.recording import Channels, Recording, format_of, open_writer


@dataclass(slots=True)
class Converted:
    """frames   written
    omitted  by reason: frames that could not be read or have no place in this bench
    complaint  of the input as a whole
    strayed  by reason: frames that are there, but not where they should be
    renamed  buses that come back under another name
    """

    frames: int = 0
    omitted: Counter[str] = field(default_factory=Counter)
    complaint: str = ""
    strayed: Counter[str] = field(default_factory=Counter)
    renamed: dict[str, str] = field(default_factory=dict)

    def remarks(self, source: Path, out: Path) -> list[str]:
        """What is not in the new file as it was in the old one, in lines."""
        return [
            *([f"{source}: {self.complaint}"] if self.complaint else []),
            *(f"{source}: frames left out: {count} {reason}" for reason, count in self.omitted.items()),
            *(f"{source}: {count} frames {reason}" for reason, count in self.strayed.items()),
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
                done.frames += len(piece[0])
                progress(done.frames, recording.share)
        finally:
            writer.close()
    done.omitted, done.complaint = +recording.omitted, recording.complaint
    if not kind.named:
        done.renamed = channels.renamed
    return done
