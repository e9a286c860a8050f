#include "solve.h"

#include <string.h>

#include "adjust.h"
#include "gnss.h"
#include "range.h"
#include "vec.h"

enum { MOST = MAX_RECEIVERS * MAX_CHANNELS, ROUNDS = 25, MOST_EXCLUDED = 4, NO_URA = 15, NO_COLUMN = -1 };

#define CONVERGED_M 1e-5
#define LARGEST_PDOP 655.35        /* what NAV_STATUS can say */
#define INCONSISTENT 5.0           /* sigma, of residuals as a whole: the model of errors does not hold */

#define NO_FIX(reason) GNSS_NAV_STATUS_NO_FIX_##reason##_CHOICE

struct measurement {
    int receiver, channel, satellite, domain;
    const struct channel *from;
    double range_variance_m2, rate_variance_m2ps2;
    int clock_column, offset_column; /* of the unknowns; offset: NO_COLUMN where it is zero */
};

struct problem {
    const struct vehicle *vehicle;
    double arm_ecef_m[MAX_RECEIVERS][3];     /* lever arms, and how they move relative to the Earth */
    double arm_rate_ecef_mps[MAX_RECEIVERS][3];
    struct measurement measurement[MOST];
    int measurements, unknowns;
    unsigned items;
    int column[CLOCK_ITEMS];
};

struct estimate { /* unknowns by their meaning */
    double place[3];
    double clock[CLOCK_ITEMS];
};

/* The published weighting (README.md): a floor, thermal noise inverse to C/N0, and the satellite's own error by
 * its URA. What the satellite errs is the same on all antennas that track it, so that averaging does not help:
 * each of its k measurements bears k times that variance. */
static double ura_variance_m2(unsigned ura)
{
    static const double ura_m[NO_URA] = {2, 2.8, 4, 5.7, 8, 11.3, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096};
    return ura_m[ura] * ura_m[ura]; /* IS-GPS-200, 20.3.3.3.1.3 */
}

static void weigh(struct problem *problem)
{
    int copies[SATELLITES] = {0};
    for (int i = 0; i < problem->measurements; i++)
        copies[problem->measurement[i].satellite]++;
    for (int i = 0; i < problem->measurements; i++) {
        struct measurement *m = &problem->measurement[i];
        double noise = pow(10.0, 4.5 - 0.1 * m->from->cn0_dbhz); /* relative to 45 dBHz */
        double code_m = system_of(m->satellite) == GLONASS ? 0.50 * 1.023 / 0.511 : 0.50;
        m->range_variance_m2 = 0.10 * 0.10 + code_m * code_m * noise +
                               copies[m->satellite] * ura_variance_m2(m->from->ura);
        m->rate_variance_m2ps2 = 0.005 * 0.005 + 0.05 * 0.05 * noise;
    }
}

bool channel_usable(const struct channel *channel)
{
    return channel->parts == ALL_PARTS && channel->satellite != NO_SATELLITE &&
           channel->lock == GNSS_RX1_RATE_LOCK_FULL_CHOICE && channel->healthy && channel->ura != NO_URA;
}

bool epoch_attitude(const struct epoch *epoch, double c[3][3])
{
    double w = epoch->q[0], x = epoch->q[1], y = epoch->q[2], z = epoch->q[3];
    double square = w * w + x * x + y * y + z * z;
    if ((epoch->attitude & HAVE_ATTITUDE) != HAVE_ATTITUDE || fabs(square - 1.0) > 1e-3)
        return false;
    const double matrix[3][3] = {
        {w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)},
        {2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)},
        {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z},
    };
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c[i][j] = matrix[i][j] / square;
    return true;
}

/* Lever arms in ECEF axes, and their rates: the body turns relative to the Earth by its rate relative to inertial
 * space less the Earth's. */
static void place_arms(struct problem *problem, const struct epoch *epoch, double body_from_ecef[3][3])
{
    const double earth_ecef_rps[3] = {0.0, 0.0, EARTH_RATE_RPS};
    double earth_body_rps[3], turn_rps[3], rate_body_mps[3];
    rotate(body_from_ecef, earth_ecef_rps, earth_body_rps);
    subtract(epoch->rate_body_rps, earth_body_rps, turn_rps);
    for (int a = 0; a < problem->vehicle->antennas; a++) {
        const double *arm_body_m = problem->vehicle->antenna[a].lever_arm_body_m;
        cross(turn_rps, arm_body_m, rate_body_mps);
        rotate_back(body_from_ecef, arm_body_m, problem->arm_ecef_m[a]);
        rotate_back(body_from_ecef, rate_body_mps, problem->arm_rate_ecef_mps[a]);
    }
}

static void gather(struct problem *problem, const struct intake *intake)
{
    for (int r = 0; r < problem->vehicle->antennas; r++) {
        for (int k = 0; k < problem->vehicle->antenna[r].channels; k++) {
            const struct channel *channel = &intake->epoch.receiver[r].channel[k];
            if (channel_usable(channel))
                problem->measurement[problem->measurements++] = (struct measurement){
                    .receiver = r, .channel = k, .satellite = channel->satellite,
                    .domain = intake->clock_domain[r], .from = channel};
        }
    }
}

/* Numbers the unknowns: position, a clock for each domain heard, the GLONASS offset if some domain hears both
 * systems. A domain that hears GLONASS alone has the offset in its own clock. */
static void number_unknowns(struct problem *problem)
{
    bool hears[MAX_DOMAINS][2] = {{false}};
    problem->unknowns = 3;
    problem->items = 0;
    for (int i = 0; i < problem->measurements; i++)
        hears[problem->measurement[i].domain][system_of(problem->measurement[i].satellite)] = true;
    for (int d = 0; d < MAX_DOMAINS; d++) {
        problem->items |= hears[d][GPS] || hears[d][GLONASS] ? 1U << d : 0;
        problem->items |= hears[d][GPS] && hears[d][GLONASS] ? 1U << GLONASS_OFFSET : 0;
    }
    for (int item = 0; item < CLOCK_ITEMS; item++)
        problem->column[item] = problem->items & 1U << item ? problem->unknowns++ : NO_COLUMN;
    for (int i = 0; i < problem->measurements; i++) {
        struct measurement *m = &problem->measurement[i];
        bool offset = system_of(m->satellite) == GLONASS && hears[m->domain][GPS];
        m->clock_column = problem->column[m->domain];
        m->offset_column = offset ? problem->column[GLONASS_OFFSET] : NO_COLUMN;
    }
}

static int distinct_satellites(const struct problem *problem)
{
    bool seen[SATELLITES] = {false};
    int count = 0;
    for (int i = 0; i < problem->measurements; i++) {
        bool *satellite = &seen[problem->measurement[i].satellite];
        count += !*satellite;
        *satellite = true;
    }
    return count;
}

/* A satellite on two antennas of one clock counts once: its two directions are one. */
static int independent_ranges(const struct problem *problem)
{
    bool seen[MAX_DOMAINS][SATELLITES] = {{false}};
    int count = 0;
    for (int i = 0; i < problem->measurements; i++) {
        bool *pair = &seen[problem->measurement[i].domain][problem->measurement[i].satellite];
        count += !*pair;
        *pair = true;
    }
    return count;
}

static void fill_row(const struct measurement *m, const double los[3], double stretch, double row[MAX_UNKNOWNS])
{
    memset(row, 0, MAX_UNKNOWNS * sizeof row[0]);
    for (int i = 0; i < 3; i++)
        row[i] = -los[i] / stretch;
    row[m->clock_column] = 1.0;
    if (m->offset_column != NO_COLUMN)
        row[m->offset_column] = 1.0;
}

static double clocks_of(const struct problem *problem, const struct measurement *m, const double x[CLOCK_ITEMS])
{
    (void)problem;
    return x[m->domain] + (m->offset_column != NO_COLUMN ? x[GLONASS_OFFSET] : 0.0);
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
           clocks_of(problem, m, estimate->clock);
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

static void exclude_satellite(struct problem *problem, int satellite)
{
    int kept = 0;
    for (int i = 0; i < problem->measurements; i++)
        if (problem->measurement[i].satellite != satellite)
            problem->measurement[kept++] = problem->measurement[i];
    problem->measurements = kept;
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

void solve(const struct vehicle *vehicle, const struct intake *intake, const double start_m[3], struct fix *fix)
{
    struct problem problem = {.vehicle = vehicle};
    struct estimate place, rates;
    struct normal normal;
    double body_from_ecef[3][3];

    memset(fix, 0, sizeof *fix);
    fix->no_fix = NO_FIX(NO_TIME_MARK);
    if (intake->epoch.mark != WHOLE_MARK)
        return;
    fix->no_fix = NO_FIX(NO_ATTITUDE);
    if (!epoch_attitude(&intake->epoch, body_from_ecef))
        return;
    place_arms(&problem, &intake->epoch, body_from_ecef);
    gather(&problem, intake);
    fix->no_fix = adjust_and_exclude(&problem, start_m, &place, &normal);
    if (fix->no_fix)
        return;
    fix->pdop = dilution(&problem, &place);
    if (fix->pdop < 0.0 || fix->pdop > LARGEST_PDOP) {
        fix->no_fix = NO_FIX(SINGULAR_GEOMETRY);
        return;
    }
    normal_covariance(&normal, fix->covariance_m2);
    fix->has_velocity = (intake->epoch.attitude & HAVE_RATE) && adjust_velocity(&problem, place.place, &rates);
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
