"""The sequences of the bench's protocol. A test plays them through `dbc.bus`: what each side answers is what
is drawn.

Epochs are written k, k+1, .. or as numbers, as the bench frames carry them.
"""

from __future__ import annotations

from gnss_hil.tools.icd.sequence import Chart, Does, Pause, Sent

EMULATOR, FLIGHT = "emulator", "flight software"


def block(epoch: str, what: str) -> Sent:
    return Sent(EMULATOR, f"block {epoch}: {what}")


def answer(epoch: str, what: str) -> Sent:
    return Sent(FLIGHT, f"block {epoch}: {what}")


def sync(epoch: str, lost: bool = False, session: str = "session") -> Sent:
    return Sent(EMULATOR, f"BENCH_SYNC{{{session}, {epoch}, count}}", lost)


def done(epoch: str, lost: bool = False, session: str = "session") -> Sent:
    return Sent(FLIGHT, f"BENCH_DONE{{{session}, {epoch}, count}}", lost)


HEARTBEAT = Sent(FLIGHT, "FLIGHT_HEARTBEAT{READY, contract hash}")

START = Chart(
    "Start",
    "The start barrier. A heartbeat with another contract hash does not open it: the run does not start.",
    (
        Does(FLIGHT, "joins the bus"),
        HEARTBEAT,
        Pause("100 ms"),
        HEARTBEAT,
        Does(EMULATOR, "CRC and contract hash are right"),
        block("0", "TIME_MARK .. heartbeats"),
        Does(FLIGHT, "a session it does not know:"),
        Does(FLIGHT, "begins from nothing"),
        sync("0"),
        answer("0", "NAV_STATUS .. heartbeat"),
        done("0"),
    ),
)

EPOCH = Chart(
    "An epoch",
    "In lockstep the bus is half-duplex: one side speaks, then the other. At a free pace there is neither "
    "SYNC nor DONE; an epoch is complete when every receiver's STATUS has come.",
    (
        Does(EMULATOR, "receivers latch at the mark"),
        block("k", "TIME_MARK, TIME_GPS, TIME_FINE"),
        block("k", "ATT_Q01, ATT_Q23, ATT_RATE"),
        block("k", "ten frames a channel, then TAG, STATUS"),
        block("k", "ALM_XY, ALM_Z, ALM_V; heartbeats"),
        sync("k"),
        Does(FLIGHT, "all of count heard?"),
        Does(FLIGHT, "checks, fix, assignment"),
        answer("k", "NAV_STATUS, NAV_X .. NAV_USED"),
        answer("k", "COMMANDs, heartbeat"),
        done("k"),
        Does(EMULATOR, "commands act in epoch k+1"),
    ),
)

COMMAND = Chart(
    "A command and its answer",
    "A command carries the epoch that it answers; its ACK echoes the transaction. Without an answer it is "
    "sent again under the same transaction.",
    (
        answer("k", "RX2_COMMAND{channel 5, TRACK GPS 7, 291}"),
        done("k"),
        Does(EMULATOR, "weighs the commands of epoch k:"),
        Does(EMULATOR, "RELEASEs first, then TRACKs"),
        block("k+1", "TIME_MARK .., RX2_ACK{channel 5, ACCEPTED, 291} .."),
        sync("k+1"),
        Does(FLIGHT, "channel 5 does as told"),
        answer("k+1", "NAV_STATUS .. heartbeat"),
        done("k+1"),
        Does(EMULATOR, "channel 5 searches, then locks"),
        Pause("some epochs"),
        block("k+n", "measurements of channel 5 among the others"),
        sync("k+n"),
        answer("k+n", "NAV_USED has channel 5"),
        done("k+n"),
    ),
)

LOST_SYNC = Chart(
    "A lost SYNC, a lost DONE",
    "A SYNC that is not answered is repeated. It is answered once by stepping, then with the same frames.",
    (
        block("k", "TIME_MARK .. heartbeats"),
        sync("k", lost=True),
        Pause("no answer"),
        sync("k"),
        Does(FLIGHT, "steps epoch k"),
        answer("k", "NAV_STATUS .. heartbeat"),
        done("k", lost=True),
        Pause("no answer"),
        sync("k"),
        Does(FLIGHT, "does not step again"),
        answer("k", "the same frames"),
        done("k"),
        block("k+1", "TIME_MARK .. heartbeats"),
        sync("k+1"),
        answer("k+1", "NAV_STATUS .. heartbeat"),
        done("k+1"),
    ),
)

RESTART = Chart(
    "The emulator starts again",
    "A new session: what was known under the old one (counters, almanac, commands under way) is forgotten.",
    (
        block("k", "TIME_MARK{old session} .. heartbeats"),
        sync("k", session="old session"),
        answer("k", "NAV_STATUS .. heartbeat"),
        done("k", session="old session"),
        Does(EMULATOR, "stops"),
        Pause("silence: nothing is heard for some seconds"),
        HEARTBEAT,
        Does(EMULATOR, "starts, draws a new session"),
        block("0", "TIME_MARK{new session} .. heartbeats"),
        Does(FLIGHT, "forgets the old session"),
        sync("0", session="new session"),
        answer("0", "NAV_STATUS .. heartbeat"),
        done("0", session="new session"),
    ),
)

END = Chart(
    "End",
    "BENCH_END is not answered. A flight software that goes on waiting announces itself again.",
    (
        block("n-1", "TIME_MARK .. heartbeats"),
        sync("n-1"),
        answer("n-1", "NAV_STATUS .. heartbeat"),
        done("n-1"),
        Sent(EMULATOR, "BENCH_END{session, n, COMPLETED}"),
        Does(FLIGHT, "leaves, or waits for a next run"),
    ),
)

CHARTS = (START, EPOCH, COMMAND, LOST_SYNC, RESTART, END)
