/* The way of a signal from satellite to antenna, as docs/contract.md has it. */
#ifndef RANGE_H
#define RANGE_H

struct path {
    double satellite_m[3]; /* satellite at transmission, ECEF axes of the time mark */
    double los[3];         /* unit vector from antenna to satellite */
    double distance_m;
    double shapiro_m;
};

/* antenna_m: ECEF at the mark; satellite_m: as on the bus, axes of the transmission instant. */
void signal_path(const double antenna_m[3], const double satellite_m[3], struct path *path);

/* The path length's rate is (satellite_term - los . antenna velocity) / stretch [m/s]: what does not depend on
 * the antenna's velocity. velocity_mps: the satellite's, as on the bus. */
void path_rate(const struct path *path, const double velocity_mps[3], double *satellite_term, double *stretch);

#endif
