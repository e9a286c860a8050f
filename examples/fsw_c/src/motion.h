/* Motion under the Earth's pull, in axes that turn with the Earth. */
#ifndef MOTION_H
#define MOTION_H

struct motion {
    double position_ecef_m[3];
    double velocity_ecef_mps[3]; /* relative to the Earth */
};

/* Carries a craft or satellite on by some seconds, in one step: good to 0.1 m for a navigation satellite and
 * 20 s, to metres for a low orbit and 1 s. */
void motion_carry(struct motion *motion, double seconds);

#endif
