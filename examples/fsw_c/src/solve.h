/* Position, velocity and clocks of one epoch from all channels of all antennas. */
#ifndef SOLVE_H
#define SOLVE_H

#include <stdbool.h>
#include <stdint.h>

#include "contract.h"
#include "inbox.h"
#include "vehicle.h"

struct fix {
    unsigned no_fix;                /* NoFix of the contract: 0 is a fix */
    bool has_velocity;
    double position_ecef_m[3];      /* centre of mass at the time mark */
    double velocity_ecef_mps[3];    /* relative to the Earth */
    unsigned items;                 /* bit i: clock item i is part of the solution */
    double bias_m[CLOCK_ITEMS];
    double drift_mps[CLOCK_ITEMS];
    double covariance_m2[3][3];
    double pdop;                    /* measurements alike, not weighted */
    int satellites, measurements;
    uint32_t used[MAX_RECEIVERS];   /* bit k: channel k is in the fix */
};

/* start_m: where to begin; the Earth's centre will do. */
void solve(const struct vehicle *vehicle, const struct inbox *inbox, const double start_m[3], struct fix *fix);

#endif
