/* Whose turn it is: cuts what is heard into epochs, in lockstep (BENCH_SYNC) or by time marks and clock. */
#ifndef SLAVE_H
#define SLAVE_H

#include <linux/can.h>
#include <stdbool.h>
#include <stdint.h>

enum task {
    NOTHING,
    FRAME,       /* a frame of the spacecraft's */
    BEGIN,       /* a time mark that begins a run: forget everything, then open its epoch */
    OPEN,        /* a time mark that opens an epoch */
    DOUBT,       /* a time mark that does not lead on, a stray or another run's: set it and what follows aside */
    STEP_BEFORE, /* step the open epoch, then hear the same frame again */
    STEP_OLD,    /* the same, without what was set aside: it is of its own epoch */
    BELIEVE,     /* open the epoch that was set aside, then hear the same frame again */
    STEP,        /* the epoch is whole: compute and answer */
    STEP_BLIND,  /* the same for an epoch whose time mark was not heard: open it first */
    REPEAT,      /* send the last answer again */
    END          /* the run is over */
};

struct label { /* what names an epoch on the bus */
    uint16_t session;
    uint32_t epoch;
};

struct slave {
    bool running;  /* a time mark began a run */
    bool open;     /* an epoch is open */
    bool answered; /* the last epoch was answered under lockstep */
    bool lockstep; /* a SYNC was heard in this run */
    bool first;    /* the run's first epoch: SYNC or a second mark will tell which kind of run it is */
    bool doubting; /* an epoch is set aside */
    struct label at;    /* the last epoch, open or not */
    struct label doubt; /* the one that is set aside */
    unsigned statuses;       /* bit r: receiver r + 1 has closed its epoch */
    int64_t mark_ms, last_ms;
    unsigned heard;          /* frames of the open epoch, of any quality */
    unsigned long lost;      /* frames that SYNCs announced and did not arrive */
    unsigned long refused;   /* bench frames and time marks that were not believed */
};

/* A time mark with a sound CRC. */
enum task slave_mark(struct slave *slave, struct label mark, int64_t now_ms);

/* A bench frame (BENCH_SYNC, BENCH_END; others are NOTHING). */
enum task slave_bench(struct slave *slave, const struct can_frame *frame);

/* After BELIEVE: the epoch set aside is open; whether it begins another run. */
bool slave_believe(struct slave *slave, int64_t now_ms);

/* Any frame of the spacecraft's, after slave_mark for marks. */
void slave_heard(struct slave *slave, int64_t now_ms);
void slave_status(struct slave *slave, int receiver);

/* When the open epoch closes by itself [ms], or -1: never. */
int64_t slave_due_ms(const struct slave *slave);

/* After a step. */
void slave_stepped(struct slave *slave, bool synced);

#endif
