/* What an identifier of the bus means: kind of message, receiver, sender, protected item. */
#ifndef FRAMES_H
#define FRAMES_H

#include <stdbool.h>
#include <stdint.h>

/* Kinds this software reads. The ten of a channel come first and in bus order, so that kind k of them is bit k. */
enum kind {
    RANGE, RATE, PHASE, SV_X, SV_Y, SV_Z, SV_VX, SV_VY, SV_VZ, SV_CLOCK,
    TAG, STATUS, ACK, ALM_XY, ALM_Z, ALM_V,
    TIME_MARK, TIME_GPS, TIME_FINE, ATT_Q01, ATT_Q23, ATT_RATE, HEARTBEAT,
    UNKNOWN
};

enum { CHANNEL_PARTS = 10, ALL_PARTS = (1 << CHANNEL_PARTS) - 1 };

/* Node numbers of the contract; receivers are 1 to 8. */
enum { NODE_ATT = 9, NODE_TIME = 10, NODES = 11 };

struct meaning {
    enum kind kind;
    int receiver; /* 1 to 8, or 0 */
    int node;     /* who sends it */
};

struct meaning meaning_of(uint32_t id);

/* Whether the kind's protected stream has a channel besides the identifier. */
bool has_channel(enum kind kind);

#endif
