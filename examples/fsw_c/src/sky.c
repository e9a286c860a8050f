#include "sky.h"

#include <string.h>

#include "range.h"
#include "vec.h"

#define EQUATOR_M 6378137.0 /* WGS-84 */
#define FLATTENING (1.0 / 298.257223563)
#define RAY_HEIGHT_M 50e3
#define OLDEST_NS (INT64_C(600) * 1000000000) /* motion_carry errs by 3 km then */

/* The ellipsoid is scaled up until its equator is raised by 50 km; its poles rise 170 m less. In axes scaled by its
 * own it is the unit sphere. */
bool ray_is_clear(const double craft_m[3], const double satellite_m[3])
{
    const double equator_m = EQUATOR_M + RAY_HEIGHT_M;
    const double axis_m[3] = {equator_m, equator_m, equator_m * (1.0 - FLATTENING)};
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

static void see(struct sky *sky, int satellite, const double craft_m[3], const double satellite_m[3], bool healthy)
{
    subtract(satellite_m, craft_m, sky->los[satellite]);
    sky->visible[satellite] = healthy && ray_is_clear(craft_m, satellite_m);
}

/* Almanac predictions first; a tracked satellite's own coordinates are better and replace them. */
void sky_look(const struct inbox *inbox, const double craft_m[3], struct sky *sky)
{
    int64_t now_ns = epoch_time_ns(&inbox->epoch);
    memset(sky, 0, sizeof *sky);
    for (int s = 0; s < SATELLITES; s++) {
        const struct almanac_entry *entry = &inbox->almanac[s];
        struct motion motion;
        if (!entry->known || now_ns < entry->t_ns || now_ns - entry->t_ns > OLDEST_NS)
            continue;
        motion = entry->motion;
        motion_carry(&motion, (double)(now_ns - entry->t_ns) * 1e-9);
        see(sky, s, craft_m, motion.position_ecef_m, entry->healthy);
    }
    for (int r = 0; r < CONTRACT_RECEIVERS; r++) {
        for (int k = 0; k < MAX_CHANNELS; k++) {
            const struct channel *channel = &inbox->epoch.receiver[r].channel[k];
            struct path path;
            if (channel->parts != ALL_PARTS || channel->satellite == NO_SATELLITE)
                continue;
            signal_path(craft_m, channel->position_ecef_m, &path);
            see(sky, channel->satellite, craft_m, path.satellite_m, channel->healthy);
        }
    }
}
