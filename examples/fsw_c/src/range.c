#include "range.h"

#include "contract.h"
#include "vec.h"

enum { FLIGHT_TIME_ROUNDS = 4 };  /* each leaves a share of omega_e |s| / c = 6e-6 of the last error */
#define NEAREST_RADIUS_M 1e6      /* Gauss-Newton starts at the Earth's centre, where Shapiro's formula has no value */

/* The Earth turns while the signal flies: axes of the transmission instant to axes of the mark. */
static void turn_by_flight(double flight_s, const double v[3], double out[3])
{
    double angle = EARTH_RATE_RPS * flight_s;
    double c = cos(angle), s = sin(angle);
    out[0] = c * v[0] + s * v[1];
    out[1] = -s * v[0] + c * v[1];
    out[2] = v[2];
}

void signal_path(const double antenna_m[3], const double satellite_m[3], struct path *path)
{
    double between[3];
    subtract(satellite_m, antenna_m, between);
    path->distance_m = norm(between);
    for (int round = 0; round < FLIGHT_TIME_ROUNDS; round++) {
        turn_by_flight(path->distance_m / LIGHT_MPS, satellite_m, path->satellite_m);
        subtract(path->satellite_m, antenna_m, between);
        path->distance_m = norm(between);
    }
    for (int i = 0; i < 3; i++)
        path->los[i] = between[i] / path->distance_m;
    double radius_m = norm(antenna_m), radii_m = radius_m + norm(satellite_m);
    path->shapiro_m = radius_m < NEAREST_RADIUS_M ? 0.0 :
        2.0 * EARTH_MU_M3PS2 / (LIGHT_MPS * LIGHT_MPS) *
        log((radii_m + path->distance_m) / (radii_m - path->distance_m));
}

/* With p = R3(omega T) s and w = R3(omega T) s', the flight time T's own change included:
 * p' = w - (rho'/c) (w + omega z x p), rho' = los . (p' - a'), solved for rho'. */
void path_rate(const struct path *path, const double velocity_mps[3], double *satellite_term, double *stretch)
{
    double w[3], inertial[3];
    turn_by_flight(path->distance_m / LIGHT_MPS, velocity_mps, w);
    inertial[0] = w[0] - EARTH_RATE_RPS * path->satellite_m[1];
    inertial[1] = w[1] + EARTH_RATE_RPS * path->satellite_m[0];
    inertial[2] = w[2];
    *satellite_term = dot(path->los, w);
    *stretch = 1.0 + dot(path->los, inertial) / LIGHT_MPS;
}
