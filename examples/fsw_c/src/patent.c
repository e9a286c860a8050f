#include "patent.h"

#include "vec.h"

/* Keeps the list in order of angle; of equal angles the lower satellite stands first, because it came first. */
static void insert(struct wish *wish, int satellite, double angle_rad)
{
    int at = wish->count++;
    for (; at > 0 && wish->angle_rad[at - 1] > angle_rad; at--) {
        wish->satellite[at] = wish->satellite[at - 1];
        wish->angle_rad[at] = wish->angle_rad[at - 1];
    }
    wish->satellite[at] = satellite;
    wish->angle_rad[at] = angle_rad;
}

void patent_assign(const struct vehicle *vehicle, double body_from_ecef[3][3], const struct sky *sky,
                   const bool barred[SATELLITES], struct wish wish[MAX_RECEIVERS])
{
    for (int a = 0; a < MAX_RECEIVERS; a++)
        wish[a].count = 0;
    for (int s = 0; s < SATELLITES; s++) {
        double los_body[3], smallest_rad = 4.0;
        int closest = 0;
        if (!sky->visible[s] || barred[s])
            continue;
        rotate(body_from_ecef, sky->los[s], los_body);
        for (int a = 0; a < vehicle->antennas; a++) {
            double angle_rad = angle_between(vehicle->antenna[a].boresight_body, los_body);
            if (angle_rad < smallest_rad) { /* the lower antenna keeps a tie */
                smallest_rad = angle_rad;
                closest = a;
            }
        }
        if (smallest_rad <= vehicle->antenna[closest].mask_rad)
            insert(&wish[closest], s, smallest_rad);
    }
    for (int a = 0; a < vehicle->antennas; a++) /* more than there are channels: the smallest angles stay */
        if (wish[a].count > vehicle->antenna[a].channels)
            wish[a].count = vehicle->antenna[a].channels;
}
