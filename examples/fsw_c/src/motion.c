#include "motion.h"

#include "contract.h"
#include "vec.h"

/* A point mass's pull, and what turning axes add: centrifugal and Coriolis. */
static void acceleration(const struct motion *motion, double out[3])
{
    const double *r = motion->position_ecef_m, *v = motion->velocity_ecef_mps;
    double distance_m = norm(r);
    double pull = -EARTH_MU_M3PS2 / (distance_m * distance_m * distance_m);
    out[0] = pull * r[0] + EARTH_RATE_RPS * (EARTH_RATE_RPS * r[0] + 2.0 * v[1]);
    out[1] = pull * r[1] + EARTH_RATE_RPS * (EARTH_RATE_RPS * r[1] - 2.0 * v[0]);
    out[2] = pull * r[2];
}

/* Heun's method: the acceleration of both ends for the velocity. */
void motion_carry(struct motion *motion, double seconds)
{
    double begin[3], end[3];
    struct motion ahead;
    acceleration(motion, begin);
    add_scaled(motion->position_ecef_m, seconds, motion->velocity_ecef_mps, ahead.position_ecef_m);
    add_scaled(ahead.position_ecef_m, 0.5 * seconds * seconds, begin, ahead.position_ecef_m);
    add_scaled(motion->velocity_ecef_mps, seconds, begin, ahead.velocity_ecef_mps);
    acceleration(&ahead, end);
    add_scaled(motion->velocity_ecef_mps, 0.5 * seconds, begin, ahead.velocity_ecef_mps);
    add_scaled(ahead.velocity_ecef_mps, 0.5 * seconds, end, ahead.velocity_ecef_mps);
    *motion = ahead;
}
