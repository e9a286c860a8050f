/* The frames of one answer. */
#ifndef BLOCK_H
#define BLOCK_H

#include <linux/can.h>

#include "contract.h"

/* Status, position, velocity, two for each clock, sigma, correlations, used channels; every channel commanded;
 * heartbeat and DONE. */
enum { MAX_BLOCK = 7 + 2 * CLOCK_ITEMS + 2 + MAX_RECEIVERS + MAX_RECEIVERS * MAX_CHANNELS + 2 };

struct block {
    int count;
    struct can_frame frame[MAX_BLOCK];
};

#endif
