/* Screens frames and gathers what they say: one epoch's measurements, attitude, time; and what lasts longer,
 * the almanac. */
#ifndef INBOX_H
#define INBOX_H

#include <linux/can.h>
#include <stdbool.h>
#include <stdint.h>

#include "contract.h"
#include "e2e.h"
#include "frames.h"
#include "motion.h"

/* Why a frame was refused. */
enum reason {
    BAD_KIND,       /* error, remote or extended frame */
    BAD_LENGTH,
    BAD_ID,
    BAD_CRC,        /* or counter 15 */
    BAD_EPOCH,      /* of another epoch than the open one */
    BAD_REPEATED,
    BAD_SEQUENCE,
    BAD_CONTRACT,   /* its node says another contract hash */
    BAD_VALUE,      /* a number that names nothing */
    REASONS
};

extern const char *const reason_names[REASONS];

struct channel { /* a channel's ten frames */
    unsigned parts; /* bit k: kind k has come */
    int satellite;  /* or NO_SATELLITE */
    unsigned signal, lock;
    int ura;
    bool healthy;
    double pseudorange_m, range_rate_mps, cn0_dbhz;
    double position_ecef_m[3], velocity_ecef_mps[3]; /* axes of the transmission instant */
    double clock_m, clock_drift_mps;
};

struct receiver {
    struct channel channel[MAX_CHANNELS];
    bool status; /* STATUS has come: the receiver's epoch is closed */
};

struct ack {
    int receiver; /* 1 to 8 */
    unsigned channel, result, transaction;
};

struct almanac_entry {
    bool known, healthy;
    int64_t t_ns; /* GPS time of the prediction */
    struct motion motion;
};

enum { MARK_SESSION = 1, MARK_GPS = 2, MARK_FINE = 4, WHOLE_MARK = 7 };
enum { HAVE_Q01 = 1, HAVE_Q23 = 2, HAVE_ATTITUDE = 3, HAVE_RATE = 4 };
enum { MAX_ACKS = 2 * MAX_RECEIVERS * MAX_CHANNELS };

struct epoch { /* all that came in the open epoch */
    uint32_t number;
    unsigned mark;          /* which frames of the time mark came */
    int64_t week, second, nanosecond;
    unsigned mark_clock; /* 0: the mark is GPS time; k + 1: what the clock of domain k showed */
    unsigned attitude;      /* which frames of the attitude came */
    double q[4];            /* body from ECEF, scalar first */
    double rate_body_rps[3];/* relative to inertial space */
    struct receiver receiver[MAX_RECEIVERS];
    struct ack ack[MAX_ACKS];
    int acks;
    bool heard[NODES];
};

struct inbox {
    struct e2e_streams streams;
    struct epoch epoch;
    struct almanac_entry almanac[SATELLITES];
    struct almanac_entry slice[MAX_RECEIVERS]; /* an entry on its way: three frames of one receiver */
    int slice_satellite[MAX_RECEIVERS];
    unsigned slice_parts[MAX_RECEIVERS];
    int clock_domain[MAX_RECEIVERS];  /* as TAG said last; the vehicle file's before */
    bool other_contract[NODES];
    bool known[NODES];                /* heard in some epoch */
    unsigned long refused[REASONS];
    unsigned long frames_lost;        /* by the streams' counters */
    unsigned long nodes_silent;       /* epochs in which a node heard before was silent */
};

/* A frame that bears a sound CRC under a plain identifier of the contract; counts what does not. */
bool inbox_sound(struct inbox *inbox, const struct can_frame *frame, struct meaning *meaning);

/* Opens an epoch: forgets what the last one brought. */
void inbox_open(struct inbox *inbox, uint32_t epoch);

/* Takes a sound frame into the open epoch, or counts why not. */
void inbox_take(struct inbox *inbox, const struct can_frame *frame, struct meaning meaning);

/* A heartbeat before the first epoch: only its contract hash counts. */
void inbox_greet(struct inbox *inbox, const struct can_frame *frame, struct meaning meaning);

/* Closes the books of an epoch: which nodes were silent. */
void inbox_close(struct inbox *inbox);

/* GPS time of the whole mark [ns]. */
int64_t epoch_time_ns(const struct epoch *epoch);

#endif
