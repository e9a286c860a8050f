#include "measure.h"

#include <string.h>

#include "gnss.h"
#include "vec.h"

enum { NO_URA = 15 };

#define LOWEST_SATELLITE_M 6378137.0 /* the Earth's equator, WGS-84: what is below it is no satellite */

bool channel_usable(const struct channel *channel)
{
    return channel->parts == ALL_PARTS && channel->satellite != NO_SATELLITE &&
           channel->lock == GNSS_RX1_RATE_LOCK_FULL_CHOICE && channel->healthy && channel->ura != NO_URA &&
           norm(channel->position_ecef_m) > LOWEST_SATELLITE_M;
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

/* Signals in the order of preference, by their number in the contract: L1 and E1 before L5 and L2, open codes first. */
static const unsigned char preference[16] = {
    [GNSS_RX1_RATE_SIGNAL_L1_CA_CHOICE] = 0, [GNSS_RX1_RATE_SIGNAL_L1_OF_CHOICE] = 1,
    [GNSS_RX1_RATE_SIGNAL_E1_CHOICE] = 2,    [GNSS_RX1_RATE_SIGNAL_L1_P_CHOICE] = 3,
    [GNSS_RX1_RATE_SIGNAL_L5_CHOICE] = 4,    [GNSS_RX1_RATE_SIGNAL_L2_C_CHOICE] = 5,
    [GNSS_RX1_RATE_SIGNAL_L2_P_CHOICE] = 6,  [GNSS_RX1_RATE_SIGNAL_L2_OF_CHOICE] = 7,
    [8] = 8, [9] = 8, [10] = 8, [11] = 8, [12] = 8, [13] = 8, [14] = 8, [15] = 8,
};

/* Of a receiver's several signals of one satellite one stands for it: together they would count it twice. */
static bool stands_for_satellite(const struct channel *channels, int count, int k)
{
    const struct channel *mine = &channels[k];
    for (int j = 0; j < count; j++) {
        const struct channel *other = &channels[j];
        if (j == k || other->satellite != mine->satellite || !channel_usable(other))
            continue;
        int before = preference[other->signal] - preference[mine->signal];
        if (before < 0 || (before == 0 && j < k))
            return false;
    }
    return true;
}

static void gather(struct problem *problem, const struct inbox *inbox)
{
    for (int r = 0; r < problem->vehicle->antennas; r++) {
        for (int k = 0; k < problem->vehicle->antenna[r].channels; k++) {
            const struct channel *channels = inbox->epoch.receiver[r].channel, *channel = &channels[k];
            if (channel_usable(channel) &&
                stands_for_satellite(channels, problem->vehicle->antenna[r].channels, k))
                problem->measurement[problem->measurements++] = (struct measurement){
                    .receiver = r, .channel = k, .satellite = channel->satellite,
                    .domain = inbox->clock_domain[r], .from = channel};
        }
    }
}

void measure(struct problem *problem, const struct vehicle *vehicle, const struct inbox *inbox,
             double body_from_ecef[3][3])
{
    memset(problem, 0, sizeof *problem);
    problem->vehicle = vehicle;
    place_arms(problem, &inbox->epoch, body_from_ecef);
    gather(problem, inbox);
}

/* The published weighting (README.md): thermal noise of the code loop, inverse to C/N0, and the satellite's own
 * error: what its system usually errs by, more where its accuracy index is worse than usual, less where it
 * promises to be better. What the satellite errs is the same on all antennas that track it, so that averaging does not help:
 * each of its k measurements bears k times that variance. */
static double accuracy_m(int ura)
{
    static const double from_0[NO_URA] = {2, 2.8, 4, 5.7, 8, 11.3, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096};
    return ura < 0 ? pow(2.0, 1.0 + 0.5 * ura) : from_0[ura]; /* IS-GPS-200, 20.3.3.3.1.3 and 30.3.3.1.1.4 */
}

/* What a satellite's report makes ranges err by, as a share of what its system's usually do. */
static double worse_than_usual(bool glonass, int ura)
{
    double usual_accuracy_m = glonass ? accuracy_m(4) : accuracy_m(0), usual_m = glonass ? 2.0 : 0.6;
    return fmin(fmax(accuracy_m(ura) / usual_accuracy_m, 1.0), accuracy_m(ura) / usual_m);
}

static double space_variance_m2(bool glonass, int ura)
{
    double orbit_m = (glonass ? 2.0 : 0.6) * worse_than_usual(glonass, ura);
    double code_m = glonass ? 0.0 : fmin(0.28, accuracy_m(ura)); /* C/A against the P code of GPS clocks */
    return orbit_m * orbit_m + code_m * code_m;
}

/* Code loop: early minus late power, half a chip apart, 0.5 Hz, 20 ms. Kaplan & Hegarty, 8.9 */
static double code_variance_m2(bool glonass, double cn0_hz)
{
    double chip_m = LIGHT_MPS / (glonass ? 0.511e6 : 1.023e6);
    return chip_m * chip_m * 0.5 * 0.5 / (2.0 * cn0_hz) * (1.0 + 2.0 / (1.5 * 0.02 * cn0_hz));
}

/* Frequency loop: 2 Hz, 20 ms; and a satellite's clock within a second. */
static double rate_variance_m2ps2(bool glonass, double cn0_hz, int ura)
{
    double turn_m = LIGHT_MPS / (glonass ? 1602.0e6 : 1575.42e6) / (6.283185307179586 * 0.02);
    double clock_mps = (glonass ? 0.003 : 0.0015) * worse_than_usual(glonass, ura);
    return turn_m * turn_m * 4.0 * 2.0 / cn0_hz * (1.0 + 1.0 / (0.02 * cn0_hz)) + clock_mps * clock_mps;
}

void weigh(struct problem *problem)
{
    int copies[SATELLITES] = {0};
    for (int i = 0; i < problem->measurements; i++)
        copies[problem->measurement[i].satellite]++;
    for (int i = 0; i < problem->measurements; i++) {
        struct measurement *m = &problem->measurement[i];
        bool glonass = system_of(m->satellite) == GLONASS;
        double cn0_hz = pow(10.0, 0.1 * m->from->cn0_dbhz), copies_of = copies[m->satellite];
        m->range_variance_m2 =
            code_variance_m2(glonass, cn0_hz) + copies_of * space_variance_m2(glonass, m->from->ura);
        m->rate_variance_m2ps2 = rate_variance_m2ps2(glonass, cn0_hz, m->from->ura);
    }
}

/* Numbers the unknowns: position, a clock for each domain heard, the GLONASS offset if some domain hears both
 * systems. A domain that hears GLONASS alone has the offset in its own clock. */
void number_unknowns(struct problem *problem)
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

int distinct_satellites(const struct problem *problem)
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
int independent_ranges(const struct problem *problem)
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

void exclude_satellite(struct problem *problem, int satellite)
{
    int kept = 0;
    for (int i = 0; i < problem->measurements; i++)
        if (problem->measurement[i].satellite != satellite)
            problem->measurement[kept++] = problem->measurement[i];
    problem->measurements = kept;
}
