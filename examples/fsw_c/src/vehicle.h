/* The vehicle file: what is known of the craft's antennas. */
#ifndef VEHICLE_H
#define VEHICLE_H

#include <stddef.h>

#include "contract.h"

struct antenna {
    int channels;
    int clock_domain;
    double boresight_body[3];    /* unit vector */
    double lever_arm_body_m[3];  /* phase centre from the centre of mass */
    double mask_rad;             /* largest angle off boresight */
};

struct vehicle {
    int antennas;
    struct antenna antenna[MAX_RECEIVERS]; /* row a is receiver a + 1 */
};

/* Reads the file; 0, or -1 with one line for people in `why`. */
int vehicle_read(const char *path, struct vehicle *vehicle, char *why, size_t size);

#endif
