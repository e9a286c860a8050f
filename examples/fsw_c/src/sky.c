#include "sky.h"

#include <string.h>

#include "range.h"
#include "vec.h"

#define EQUATOR_M 6378137.0 /* WGS-84 */
#define POLE_M 6356752.3142
#define RAY_HEIGHT_M 50e3
#define OLDEST_NS (INT64_C(600) * 1000000000) /* the cubic term left out below has grown to 3 km then */

/* In axes scaled by the raised ellipsoid's, it is the unit sphere. */
bool ray_is_clear(const double craft_m[3], const double satellite_m[3])
{
    const double axis_m[3] = {EQUATOR_M + RAY_HEIGHT_M, EQUATOR_M + RAY_HEIGHT_M, POLE_M + RAY_HEIGHT_M};
    double from[3], along[3], nearest[3];
    for (int i = 0; i < 3; i++) {
        from[i] = craft_m[i] / axis_m[i];
        along[i] = (satellite_m[i] - craft_m[i]) / axis_m[i];
    }
    double share = -dot(from, along) / dot(along, along);
    share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
    add_scaled(from, share, along, nearest);
    return dot(nearest, nearest) >= 1.0;
}

/* A prediction carried on: its velocity, the Earth's pull, and what turning axes add. A straight line would be off
 * by 110 m at the end of a cycle of 20 s. */
static void carry_on(const struct almanac_entry *entry, double seconds, double out[3])
{
    const double *r = entry->position_ecef_m, *v = entry->velocity_ecef_mps;
    double distance_m = norm(r);
    double pull = -EARTH_MU_M3PS2 / (distance_m * distance_m * distance_m);
    const double acceleration_mps2[3] = {
        pull * r[0] + EARTH_RATE_RPS * (EARTH_RATE_RPS * r[0] + 2.0 * v[1]),
        pull * r[1] + EARTH_RATE_RPS * (EARTH_RATE_RPS * r[1] - 2.0 * v[0]),
        pull * r[2],
    };
    add_scaled(r, seconds, v, out);
    add_scaled(out, 0.5 * seconds * seconds, acceleration_mps2, out);
}

static void see(struct sky *sky, int satellite, const double craft_m[3], const double satellite_m[3], bool healthy)
{
    subtract(satellite_m, craft_m, sky->los[satellite]);
    sky->visible[satellite] = healthy && ray_is_clear(craft_m, satellite_m);
}

/* Almanac predictions first; a tracked satellite's own coordinates are better and replace them. */
void sky_look(const struct intake *intake, const double craft_m[3], struct sky *sky)
{
    int64_t now_ns = epoch_time_ns(&intake->epoch);
    memset(sky, 0, sizeof *sky);
    for (int s = 0; s < SATELLITES; s++) {
        const struct almanac_entry *entry = &intake->almanac[s];
        double carried_m[3];
        if (!entry->known || now_ns < entry->t_ns || now_ns - entry->t_ns > OLDEST_NS)
            continue;
        carry_on(entry, (double)(now_ns - entry->t_ns) * 1e-9, carried_m);
        see(sky, s, craft_m, carried_m, entry->healthy);
    }
    for (int r = 0; r < CONTRACT_RECEIVERS; r++) {
        for (int k = 0; k < MAX_CHANNELS; k++) {
            const struct channel *channel = &intake->epoch.receiver[r].channel[k];
            struct path path;
            if (channel->parts != ALL_PARTS || channel->satellite == NO_SATELLITE)
                continue;
            signal_path(craft_m, channel->position_ecef_m, &path);
            see(sky, channel->satellite, craft_m, path.satellite_m, channel->healthy);
        }
    }
}
