/* The flight software as a whole: all of its state, and what one frame or one moment of silence does to it. */
#ifndef FLIGHT_H
#define FLIGHT_H

#include <linux/can.h>
#include <stdbool.h>
#include <stdint.h>

#include "slave.h"
#include "inbox.h"
#include "motion.h"
#include "orders.h"
#include "publish.h"
#include "solve.h"
#include "vehicle.h"

enum { MOST_ASIDE = 4096 };   /* frames behind a time mark that does not lead on; more than any block has */
enum { MS_SILENCE = 5000 }; /* without a frame for so long the time master is taken for gone */

struct flight {
    struct vehicle vehicle;
    struct slave slave;
    struct can_frame aside[MOST_ASIDE]; /* heard since a mark that does not lead on: of the open epoch, or of its own */
    int asides;
    struct inbox inbox;
    struct orders orders;
    struct outbox outbox;
    struct fix fix;
    struct motion craft; /* the last fix, carried on through epochs without one: where a solution starts */
    bool craft_known;
    int64_t craft_ns;    /* GPS time of it */
    bool ended;        /* the run is over */
    int64_t heard_ms;  /* when a frame was heard last */
    unsigned long epochs, fixes;
};

/* Hears a frame; true: send `outbox.block`, and hear the frame again if `*again`. */
bool flight_hear(struct flight *flight, const struct can_frame *frame, int64_t now_ms, bool *again);

/* Time passes; true: send `outbox.block`. */
bool flight_wait(struct flight *flight, int64_t now_ms);

/* The start heartbeat: before the first epoch, and when the time master has gone. */
bool flight_is_waiting(const struct flight *flight, int64_t now_ms);
struct can_frame flight_greeting(void);

#endif
