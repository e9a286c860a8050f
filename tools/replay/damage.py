"""What a recording lacks of the run that it is of: frames lost or refused, epochs without a time mark. And
what is in it besides: another run.

Such a recording can be replayed, but the other side does not hear all that was said then, and may answer
otherwise.
"""

from __future__ import annotations

from gnss_hil.dbc.common.counts import noun, so_many
from gnss_hil.tools.decoder.screen import Screen
from gnss_hil.tools.replay.recorded_run import RecordedRun


def lines(recorded: RecordedRun) -> list[str]:
    """Lines for people, if anything is missing, or if the recording has more than one run."""
    screen, epochs, last = Screen(recorded.codec), 0, recorded.first
    behind: list[int] = []
    for epoch in recorded.epochs(behind.append):
        screen.take(epoch.emulator)
        screen.take(epoch.flight)
        epochs, last = epochs + 1, epoch.number
    spanned = last - recorded.first + 1
    counters = screen.counters
    refused = ", ".join(f"{count} {reason}" for reason, count in counters.reasons.items())
    parts = [
        *([f"frames missing by their counters: {counters.lost}"] if counters.lost else []),
        *([f"frames do not pass their checks: {refused}"] if refused else []),
        *(
            [f"{spanned - epochs} of {spanned} epochs {noun(spanned - epochs, 'is', 'are')} missing"]
            if epochs < spanned
            else []
        ),
    ]
    where = f"{recorded.recording.path}: {recorded.bus}"
    return [
        *([f"{where}: the recording is not whole: {'; '.join(parts)}"] if parts else []),
        *(
            f"{where}: behind the {so_many(epochs, 'epoch')} of this run another one follows, "
            f"{so_many(count, 'time mark')}; it is not replayed"
            for count in behind
            if count
        ),
    ]
