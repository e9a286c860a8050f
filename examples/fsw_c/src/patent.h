/* RU 2706636 C1: each visible satellite belongs to the one antenna that sees it closest to its axis. */
#ifndef PATENT_H
#define PATENT_H

#include "contract.h"
#include "sky.h"
#include "vehicle.h"

struct wish { /* the satellites one receiver shall track, closest to its axis first */
    int count;
    int satellite[SATELLITES];
    double angle_rad[SATELLITES];
};

/* barred: satellites that must be left alone. */
void patent_assign(const struct vehicle *vehicle, double body_from_ecef[3][3], const struct sky *sky,
                   const bool barred[SATELLITES], struct wish wish[MAX_RECEIVERS]);

#endif
