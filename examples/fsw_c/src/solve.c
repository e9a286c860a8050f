#include "solve.h"

#include <string.h>

#include "adjust.h"
#include "gnss.h"
#include "measure.h"
#include "range.h"
#include "vec.h"

enum { ROUNDS = 25, MOST_EXCLUDED = 4 };

#define CONVERGED_M 1e-5
#define LARGEST_PDOP 655.35        /* what NAV_STATUS can say */
#define INCONSISTENT 5.0           /* sigma, of residuals as a whole: the model of errors does not hold */

#define NO_FIX(reason) GNSS_NAV_STATUS_NO_FIX_##reason##_CHOICE

struct estimate { /* unknowns by their meaning */
    double place[3];
    double clock[CLOCK_ITEMS];
};

static void fill_row(const struct measurement *m, const double los[3], double stretch, double row[MAX_UNKNOWNS])
{
    memset(row, 0, MAX_UNKNOWNS * sizeof row[0]);
    for (int i = 0; i < 3; i++)
        row[i] = -los[i] / stretch;
    row[m->clock_column] = 1.0;
    if (m->offset_column != NO_COLUMN)
        row[m->offset_column] = 1.0;
}

static double clocks_of(const struct measurement *m, const double clock_m[CLOCK_ITEMS])
{
    return clock_m[m->domain] + (m->offset_column != NO_COLUMN ? clock_m[GLONASS_OFFSET] : 0.0);
}

static void add_step(const struct problem *problem, struct estimate *estimate, const double step[MAX_UNKNOWNS])
{
    for (int i = 0; i < 3; i++)
        estimate->place[i] += step[i];
    for (int item = 0; item < CLOCK_ITEMS; item++)
        if (problem->column[item] != NO_COLUMN)
            estimate->clock[item] += step[problem->column[item]];
}

/* Path from a measurement's satellite to its antenna, the centre of mass being at `place`; residual [m]. */
static double range_residual(const struct problem *problem, const struct measurement *m,
                             const struct estimate *estimate, struct path *path)
{
    double antenna_m[3];
    add_scaled(estimate->place, 1.0, problem->arm_ecef_m[m->receiver], antenna_m);
    signal_path(antenna_m, m->from->position_ecef_m, path);
    return m->from->pseudorange_m + m->from->clock_m - path->distance_m - path->shapiro_m -
           clocks_of(m, estimate->clock);
}

/* Gauss-Newton; NO_FIX(FIX), or why it failed. `normal` is left factored, at the solution. */
static unsigned adjust_position(const struct problem *problem, struct estimate *estimate, struct normal *normal)
{
    double row[MAX_UNKNOWNS], step[MAX_UNKNOWNS];
    struct path path;
    for (int round = 0; round < ROUNDS; round++) {
        normal_clear(normal, problem->unknowns);
        for (int i = 0; i < problem->measurements; i++) {
            const struct measurement *m = &problem->measurement[i];
            double residual_m = range_residual(problem, m, estimate, &path);
            fill_row(m, path.los, 1.0, row);
            normal_add(normal, row, residual_m, 1.0 / m->range_variance_m2);
        }
        if (!normal_factor(normal))
            return NO_FIX(SINGULAR_GEOMETRY);
        normal_solve(normal, step);
        add_step(problem, estimate, step);
        if (norm(step) < CONVERGED_M)
            return NO_FIX(FIX);
    }
    return NO_FIX(NO_CONVERGENCE);
}

/* Position dilution with all measurements alike; negative where there is none. */
static double dilution(const struct problem *problem, const struct estimate *estimate)
{
    double row[MAX_UNKNOWNS], covariance[3][3];
    struct normal normal;
    struct path path;
    normal_clear(&normal, problem->unknowns);
    for (int i = 0; i < problem->measurements; i++) {
        (void)range_residual(problem, &problem->measurement[i], estimate, &path);
        fill_row(&problem->measurement[i], path.los, 1.0, row);
        normal_add(&normal, row, 0.0, 1.0);
    }
    if (!normal_factor(&normal))
        return -1.0;
    normal_covariance(&normal, covariance);
    return sqrt(covariance[0][0] + covariance[1][1] + covariance[2][2]);
}

/* The row whose residual is the largest against its sigma, if the residuals as a whole are larger than the model
 * of errors explains; else -1. */
static int worst_row(const struct problem *problem, const struct estimate *estimate)
{
    int redundancy = problem->measurements - problem->unknowns, worst = -1;
    double sum = 0.0, largest = 0.0;
    struct path path;
    for (int i = 0; i < problem->measurements; i++) {
        const struct measurement *m = &problem->measurement[i];
        double residual_m = range_residual(problem, m, estimate, &path);
        double square = residual_m * residual_m / m->range_variance_m2;
        sum += square;
        if (square > largest) {
            largest = square;
            worst = i;
        }
    }
    return redundancy > 0 && sum > INCONSISTENT * INCONSISTENT * redundancy ? worst : -1;
}

/* Solves with all, then without the satellite that fits worst, until the rest agree. */
static unsigned adjust_and_exclude(struct problem *problem, const double start_m[3], struct estimate *estimate,
                                   struct normal *normal)
{
    for (int excluded = 0; excluded <= MOST_EXCLUDED; excluded++) {
        number_unknowns(problem);
        if (independent_ranges(problem) < problem->unknowns || problem->measurements == 0)
            return excluded ? NO_FIX(INCONSISTENT_RANGES) : NO_FIX(TOO_FEW_SATELLITES);
        weigh(problem);
        memset(estimate, 0, sizeof *estimate);
        memcpy(estimate->place, start_m, sizeof estimate->place);
        unsigned reason = adjust_position(problem, estimate, normal);
        int worst = reason ? -1 : worst_row(problem, estimate);
        if (worst < 0)
            return reason;
        exclude_satellite(problem, problem->measurement[worst].satellite);
    }
    return NO_FIX(INCONSISTENT_RANGES);
}

/* Velocity and drifts: linear, but for the satellite clock's drift over the flight time's change (some 10 um/s),
 * where the measured rate stands for the path's. */
static bool adjust_velocity(const struct problem *problem, const double place_m[3], struct estimate *rates)
{
    double row[MAX_UNKNOWNS], antenna_m[3], term_mps, stretch, step[MAX_UNKNOWNS];
    struct normal normal;
    struct path path;
    normal_clear(&normal, problem->unknowns);
    for (int i = 0; i < problem->measurements; i++) {
        const struct measurement *m = &problem->measurement[i];
        const struct channel *from = m->from;
        add_scaled(place_m, 1.0, problem->arm_ecef_m[m->receiver], antenna_m);
        signal_path(antenna_m, from->position_ecef_m, &path);
        path_rate(&path, from->velocity_ecef_mps, &term_mps, &stretch);
        term_mps -= dot(path.los, problem->arm_rate_ecef_mps[m->receiver]);
        double measured_mps =
            from->range_rate_mps + from->clock_drift_mps * (1.0 - from->range_rate_mps / LIGHT_MPS);
        fill_row(m, path.los, stretch, row);
        normal_add(&normal, row, measured_mps - term_mps / stretch, 1.0 / m->rate_variance_m2ps2);
    }
    memset(rates, 0, sizeof *rates);
    if (!normal_factor(&normal))
        return false;
    normal_solve(&normal, step);
    add_step(problem, rates, step);
    return true;
}

void solve(const struct vehicle *vehicle, const struct inbox *inbox, const double start_m[3], struct fix *fix)
{
    struct problem problem;
    struct estimate place, rates;
    struct normal normal;
    double body_from_ecef[3][3];

    memset(fix, 0, sizeof *fix);
    fix->no_fix = NO_FIX(NO_TIME_MARK);
    if (inbox->epoch.mark != WHOLE_MARK)
        return;
    fix->no_fix = NO_FIX(NO_ATTITUDE);
    if (!epoch_attitude(&inbox->epoch, body_from_ecef))
        return;
    measure(&problem, vehicle, inbox, body_from_ecef);
    fix->no_fix = adjust_and_exclude(&problem, start_m, &place, &normal);
    if (fix->no_fix)
        return;
    fix->pdop = dilution(&problem, &place);
    if (fix->pdop < 0.0 || fix->pdop > LARGEST_PDOP) {
        fix->no_fix = NO_FIX(SINGULAR_GEOMETRY);
        return;
    }
    normal_covariance(&normal, fix->covariance_m2);
    fix->has_velocity = (inbox->epoch.attitude & HAVE_RATE) && adjust_velocity(&problem, place.place, &rates);
    memcpy(fix->position_ecef_m, place.place, sizeof fix->position_ecef_m);
    memcpy(fix->bias_m, place.clock, sizeof fix->bias_m);
    if (fix->has_velocity) {
        memcpy(fix->velocity_ecef_mps, rates.place, sizeof fix->velocity_ecef_mps);
        memcpy(fix->drift_mps, rates.clock, sizeof fix->drift_mps);
    }
    fix->items = problem.items;
    fix->measurements = problem.measurements;
    fix->satellites = distinct_satellites(&problem);
    for (int i = 0; i < problem.measurements; i++)
        fix->used[problem.measurement[i].receiver] |= 1U << problem.measurement[i].channel;
}
