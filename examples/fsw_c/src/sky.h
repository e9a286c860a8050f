/* Where the satellites stand at the time mark, tracked or predicted, and which of them can be seen. */
#ifndef SKY_H
#define SKY_H

#include <stdbool.h>

#include "contract.h"
#include "inbox.h"

struct sky {
    bool visible[SATELLITES]; /* known, healthy and clear of the Earth */
    double los[SATELLITES][3]; /* from the craft, ECEF axes of the mark; not a unit vector */
};

void sky_look(const struct inbox *inbox, const double craft_m[3], struct sky *sky);

/* Whether the straight line between two points stays clear of the Earth and 50 km of its air. */
bool ray_is_clear(const double craft_m[3], const double satellite_m[3]);

#endif
