#include "publish.h"

#include <math.h>
#include <string.h>

#include "frames.h"
#include "gnss.h"

void publish_begin(struct outbox *outbox, uint32_t epoch)
{
    outbox->block.count = 0;
    outbox->epoch = epoch;
}

/* A frame to be filled: the next of the block. The block has room for all that can be sent. */
static struct can_frame *next_frame(struct outbox *outbox, uint32_t id)
{
    struct can_frame *frame = &outbox->block.frame[outbox->block.count++];
    memset(frame, 0, sizeof *frame);
    frame->can_id = id;
    frame->can_dlc = 8;
    return frame;
}

static void protect(struct outbox *outbox, struct can_frame *frame, unsigned item)
{
    e2e_protect(&outbox->streams, frame->can_id, item, outbox->epoch, frame->data);
}

/* Packs and protects a message. A value that does not fit its signal must not be sent (docs/contract.md, Bus): the
 * frame is dropped. */
#define PACK(outbox, message, ID, item, raw, fits) \
    do { \
        struct can_frame *frame = next_frame(outbox, GNSS_##ID##_FRAME_ID); \
        if ((fits) && gnss_##message##_pack(frame->data, &(raw), 8) == 8) \
            protect(outbox, frame, item); \
        else \
            (outbox)->block.count--; \
    } while (0)

#define ONE_VALUE(function, message, ID, signal) \
    static void function(struct outbox *outbox, double value) \
    { \
        struct gnss_##message##_t raw = {0}; \
        raw.signal = gnss_##message##_##signal##_encode(value); \
        PACK(outbox, message, ID, 0, raw, gnss_##message##_##signal##_is_in_range(raw.signal)); \
    }

/* Ranges of the signals of a fix. They are asked before a value is encoded: an encoder's conversion to an integer
 * is undefined for what does not fit that. */
#define STEP 0.0001
enum { POSITION_BITS = 41, VELOCITY_BITS = 28 };

static bool fits(double value, int bits)
{
    double top = ldexp(STEP, bits - 1);
    return value >= -top && value <= top - STEP; /* false for what is not a number */
}

static bool all_fit(const double *values, unsigned count, unsigned which, int bits)
{
    bool fit = true;
    for (unsigned i = 0; i < count; i++)
        fit &= !(which >> i & 1U) || fits(values[i], bits);
    return fit;
}

void publish_judge(struct fix *fix)
{
    const unsigned axes = 7U;
    bool sound = all_fit(fix->position_ecef_m, 3, axes, POSITION_BITS) &&
                 all_fit(fix->bias_m, CLOCK_ITEMS, fix->items, POSITION_BITS);
    for (int i = 0; i < 3; i++)
        sound &= fix->covariance_m2[i][i] > 0.0; /* else there is no correlation */
    if (fix->no_fix == 0 && !sound) {
        memset(fix, 0, sizeof *fix);
        fix->no_fix = GNSS_NAV_STATUS_NO_FIX_NO_CONVERGENCE_CHOICE;
    }
    fix->has_velocity &= all_fit(fix->velocity_ecef_mps, 3, axes, VELOCITY_BITS) &&
                         all_fit(fix->drift_mps, CLOCK_ITEMS, fix->items, VELOCITY_BITS);
}

ONE_VALUE(put_x, nav_x, NAV_X, x_m)
ONE_VALUE(put_y, nav_y, NAV_Y, y_m)
ONE_VALUE(put_z, nav_z, NAV_Z, z_m)
ONE_VALUE(put_vx, nav_vx, NAV_VX, vx_mps)
ONE_VALUE(put_vy, nav_vy, NAV_VY, vy_mps)
ONE_VALUE(put_vz, nav_vz, NAV_VZ, vz_mps)

static void put_status(struct outbox *outbox, const struct fix *fix)
{
    struct gnss_nav_status_t raw = {0};
    raw.mode = fix->no_fix ? GNSS_NAV_STATUS_MODE_NO_FIX_CHOICE
               : fix->has_velocity ? GNSS_NAV_STATUS_MODE_POSITION_VELOCITY_CHOICE
                                   : GNSS_NAV_STATUS_MODE_POSITION_CHOICE;
    raw.no_fix = (uint8_t)fix->no_fix;
    raw.satellites = (uint8_t)fix->satellites;
    raw.measurements = (uint8_t)(fix->measurements < 255 ? fix->measurements : 255);
    raw.pdop = gnss_nav_status_pdop_encode(fix->pdop);
    PACK(outbox, nav_status, NAV_STATUS, 0, raw, true);
}

static void put_clocks(struct outbox *outbox, const struct fix *fix)
{
    for (unsigned item = 0; item < CLOCK_ITEMS; item++) {
        struct gnss_nav_clock_t raw = {.item = (uint8_t)item};
        raw.bias_m = gnss_nav_clock_bias_m_encode(fix->bias_m[item]);
        if (fix->items & 1U << item)
            PACK(outbox, nav_clock, NAV_CLOCK, item, raw, gnss_nav_clock_bias_m_is_in_range(raw.bias_m));
    }
    for (unsigned item = 0; item < CLOCK_ITEMS && fix->has_velocity; item++) {
        struct gnss_nav_drift_t raw = {.item = (uint8_t)item};
        raw.drift_mps = gnss_nav_drift_drift_mps_encode(fix->drift_mps[item]);
        if (fix->items & 1U << item)
            PACK(outbox, nav_drift, NAV_DRIFT, item, raw, gnss_nav_drift_drift_mps_is_in_range(raw.drift_mps));
    }
}

static double saturated_sigma_m(double variance_m2) { return fmin(sqrt(variance_m2), 655.35); }

static double correlation(double c[3][3], int i, int j)
{
    return fmax(-1.0, fmin(1.0, c[i][j] / sqrt(c[i][i]) / sqrt(c[j][j])));
}

static void put_covariance(struct outbox *outbox, double c[3][3])
{
    struct gnss_nav_sigma_t sigma = {0};
    struct gnss_nav_corr_t rho = {0};
    sigma.sigma_x_m = gnss_nav_sigma_sigma_x_m_encode(saturated_sigma_m(c[0][0]));
    sigma.sigma_y_m = gnss_nav_sigma_sigma_y_m_encode(saturated_sigma_m(c[1][1]));
    sigma.sigma_z_m = gnss_nav_sigma_sigma_z_m_encode(saturated_sigma_m(c[2][2]));
    rho.rho_xy = gnss_nav_corr_rho_xy_encode(correlation(c, 0, 1));
    rho.rho_xz = gnss_nav_corr_rho_xz_encode(correlation(c, 0, 2));
    rho.rho_yz = gnss_nav_corr_rho_yz_encode(correlation(c, 1, 2));
    PACK(outbox, nav_sigma, NAV_SIGMA, 0, sigma, true);
    PACK(outbox, nav_corr, NAV_CORR, 0, rho, true);
}

void publish_fix(struct outbox *outbox, const struct vehicle *vehicle, const struct fix *fix)
{
    double covariance_m2[3][3];
    put_status(outbox, fix);
    if (fix->no_fix)
        return;
    put_x(outbox, fix->position_ecef_m[0]);
    put_y(outbox, fix->position_ecef_m[1]);
    put_z(outbox, fix->position_ecef_m[2]);
    if (fix->has_velocity) {
        put_vx(outbox, fix->velocity_ecef_mps[0]);
        put_vy(outbox, fix->velocity_ecef_mps[1]);
        put_vz(outbox, fix->velocity_ecef_mps[2]);
    }
    put_clocks(outbox, fix);
    memcpy(covariance_m2, fix->covariance_m2, sizeof covariance_m2);
    put_covariance(outbox, covariance_m2);
    for (unsigned r = 1; r <= (unsigned)vehicle->antennas; r++) {
        struct gnss_nav_used_t raw = {.receiver = (uint8_t)r, .channels = fix->used[r - 1]};
        PACK(outbox, nav_used, NAV_USED, r, raw, true);
    }
}

/* COMMAND's layout is the same for all receivers; the identifier tells them apart. */
static void put_command(struct outbox *outbox, int receiver_row, int channel, const struct order *order)
{
    struct gnss_rx1_command_t raw = {0};
    bool tracking = order->goal.duty == TRACKING;
    raw.channel = (uint8_t)channel;
    raw.action = tracking ? GNSS_RX1_COMMAND_ACTION_TRACK_CHOICE
                 : order->goal.duty == FREE ? GNSS_RX1_COMMAND_ACTION_AUTONOMOUS_CHOICE
                                            : GNSS_RX1_COMMAND_ACTION_RELEASE_CHOICE;
    raw.transaction = (uint16_t)order->transaction;
    if (tracking) {
        bool glonass = system_of(order->goal.satellite) == GLONASS;
        raw.sat_system = (uint8_t)system_of(order->goal.satellite);
        raw.sat_number = (uint8_t)number_of(order->goal.satellite);
        raw.signal = glonass ? GNSS_RX1_COMMAND_SIGNAL_L1_OF_CHOICE : GNSS_RX1_COMMAND_SIGNAL_L1_CA_CHOICE;
    }
    struct can_frame *frame = next_frame(outbox, GNSS_RX1_COMMAND_FRAME_ID + (uint32_t)receiver_row);
    (void)gnss_rx1_command_pack(frame->data, &raw, 8); /* fails only for a buffer below 8 bytes */
    protect(outbox, frame, (unsigned)channel);
}

void publish_orders(struct outbox *outbox, const struct vehicle *vehicle, struct orders *orders)
{
    for (int releases = 1; releases >= 0; releases--) {
        for (int a = 0; a < vehicle->antennas; a++) {
            for (int k = 0; k < vehicle->antenna[a].channels; k++) {
                struct order *order = &orders->order[a][k];
                if (!order->due || (order->goal.duty == IDLE) != (releases == 1))
                    continue;
                put_command(outbox, a, k, order);
                order->due = false;
            }
        }
    }
}

void publish_heartbeat(struct outbox *outbox, unsigned state)
{
    struct gnss_flight_heartbeat_t raw = {.state = (uint8_t)state, .contract_hash = CONTRACT_HASH};
    PACK(outbox, flight_heartbeat, FLIGHT_HEARTBEAT, 0, raw, true);
}

/* Its counter is the epoch modulo 15, so that a repeated answer is the same frames. */
void publish_done(struct outbox *outbox, uint16_t session, uint32_t epoch)
{
    struct gnss_bench_done_t raw = {.e2e_counter = (uint8_t)(epoch % COUNTERS),
                                    .epoch_mod16 = (uint8_t)(epoch & 0x0F),
                                    .epoch = (uint16_t)epoch,
                                    .session = session,
                                    .count = (uint16_t)outbox->block.count};
    struct can_frame *frame = next_frame(outbox, GNSS_BENCH_DONE_FRAME_ID);
    (void)gnss_bench_done_pack(frame->data, &raw, 8); /* fails only for a buffer below 8 bytes */
    frame->data[0] = e2e_crc(frame->can_id, frame->data);
}
