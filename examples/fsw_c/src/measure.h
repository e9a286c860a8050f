/* The measurements of an epoch, as the adjustment wants them: rows with weights and numbered unknowns. */
#ifndef MEASURE_H
#define MEASURE_H

#include <stdbool.h>

#include "contract.h"
#include "inbox.h"
#include "vehicle.h"

enum { MAX_MEASUREMENTS = MAX_RECEIVERS * MAX_CHANNELS, NO_COLUMN = -1 };

struct measurement {
    int receiver, channel, satellite, domain;
    const struct channel *from;
    double range_variance_m2, rate_variance_m2ps2;
    int clock_column, offset_column; /* of the unknowns; offset: NO_COLUMN where it is zero */
};

struct problem {
    const struct vehicle *vehicle;
    double arm_ecef_m[MAX_RECEIVERS][3];     /* lever arms, and how they move relative to the Earth */
    double arm_rate_ecef_mps[MAX_RECEIVERS][3];
    struct measurement measurement[MAX_MEASUREMENTS];
    int measurements, unknowns;
    unsigned items;
    int column[CLOCK_ITEMS];
};

/* Whether a channel's measurements may be used: all ten frames came, tracking is full, and so on. */
bool channel_usable(const struct channel *channel);

/* Body axes from ECEF; false where the epoch brought no attitude. */
bool epoch_attitude(const struct epoch *epoch, double body_from_ecef[3][3]);

/* All that may be used of an epoch; the unknowns are not numbered and nothing is weighed yet. */
void measure(struct problem *problem, const struct vehicle *vehicle, const struct inbox *inbox,
             double body_from_ecef[3][3]);

void number_unknowns(struct problem *problem);
void weigh(struct problem *problem);
void exclude_satellite(struct problem *problem, int satellite);

int distinct_satellites(const struct problem *problem);
int independent_ranges(const struct problem *problem);

#endif
