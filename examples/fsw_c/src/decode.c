/* The generated decoders at work: one small function for each kind of message. */
#include "decode.h"

#include "gnss.h"

#define NS_PER_S INT64_C(1000000000)
#define S_PER_WEEK INT64_C(604800)
#define LAST_WEEK (INT64_MAX / NS_PER_S / S_PER_WEEK - 1) /* the signal's range is larger than that of nanoseconds */

/* The generated decoders of receiver 1 serve all receivers: a kind has one layout (docs/contract.md). */
#define UNPACK(message, frame) \
    struct gnss_##message##_t raw; \
    if (gnss_##message##_unpack(&raw, (frame)->data, sizeof (frame)->data) != 0) \
        return false

#define VALUE(message, signal) gnss_##message##_##signal##_decode(raw.signal)

unsigned channel_of(const struct can_frame *frame) { return frame->data[2] & 0x1F; }

int64_t epoch_time_ns(const struct epoch *epoch)
{
    return (epoch->week * S_PER_WEEK + epoch->second) * NS_PER_S + epoch->nanosecond;
}

static bool take_range(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_range, frame);
    channel->pseudorange_m = VALUE(rx1_range, pseudorange_m);
    return true;
}

static bool take_rate(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_rate, frame);
    channel->range_rate_mps = VALUE(rx1_rate, range_rate_mps);
    channel->cn0_dbhz = VALUE(rx1_rate, cn0_dbhz);
    channel->signal = raw.signal;
    channel->lock = raw.lock;
    return true;
}

static bool take_phase(struct channel *channel, const struct can_frame *frame)
{
    (void)channel; /* carrier phase serves nothing here yet; the frame still makes the channel whole */
    UNPACK(rx1_phase, frame);
    return true;
}

static bool take_sv_x(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_x, frame);
    channel->position_ecef_m[0] = VALUE(rx1_sv_x, x_m);
    return true;
}

static bool take_sv_y(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_y, frame);
    channel->position_ecef_m[1] = VALUE(rx1_sv_y, y_m);
    return true;
}

static bool take_sv_z(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_z, frame);
    channel->position_ecef_m[2] = VALUE(rx1_sv_z, z_m);
    channel->healthy = raw.health == GNSS_RX1_SV_Z_HEALTH_HEALTHY_CHOICE;
    return true;
}

static bool take_sv_vx(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_vx, frame);
    channel->velocity_ecef_mps[0] = VALUE(rx1_sv_vx, vx_mps);
    channel->clock_drift_mps = VALUE(rx1_sv_vx, clock_drift_mps);
    return true;
}

static bool take_sv_vy(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_vy, frame);
    channel->velocity_ecef_mps[1] = VALUE(rx1_sv_vy, vy_mps);
    return true;
}

static bool take_sv_vz(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_vz, frame);
    channel->velocity_ecef_mps[2] = VALUE(rx1_sv_vz, vz_mps);
    channel->ura = raw.ura;
    return true;
}

static bool take_sv_clock(struct channel *channel, const struct can_frame *frame)
{
    UNPACK(rx1_sv_clock, frame);
    channel->clock_m = VALUE(rx1_sv_clock, clock_m);
    channel->satellite = satellite_of(raw.sat_system, raw.sat_number);
    return true;
}

static bool (*const take_part[CHANNEL_PARTS])(struct channel *, const struct can_frame *) = {
    take_range, take_rate, take_phase, take_sv_x, take_sv_y,
    take_sv_z, take_sv_vx, take_sv_vy, take_sv_vz, take_sv_clock,
};

static bool take_tag(struct inbox *inbox, int row, const struct can_frame *frame)
{
    UNPACK(rx1_tag, frame);
    inbox->clock_domain[row] = raw.clock_domain;
    return true;
}

static bool take_ack(struct inbox *inbox, int row, const struct can_frame *frame)
{
    UNPACK(rx1_ack, frame);
    struct epoch *epoch = &inbox->epoch;
    if (epoch->acks == MAX_ACKS)
        return false;
    epoch->ack[epoch->acks++] = (struct ack){row + 1, raw.channel, raw.result, raw.transaction};
    return true;
}

static bool take_alm_xy(struct inbox *inbox, int row, const struct can_frame *frame)
{
    UNPACK(rx1_alm_xy, frame);
    inbox->slice_satellite[row] = satellite_of(raw.sat_system, raw.sat_number);
    inbox->slice[row].motion.position_ecef_m[0] = VALUE(rx1_alm_xy, x_m);
    inbox->slice[row].motion.position_ecef_m[1] = VALUE(rx1_alm_xy, y_m);
    inbox->slice_parts[row] = 1;
    return true;
}

static bool take_alm_z(struct inbox *inbox, int row, const struct can_frame *frame)
{
    UNPACK(rx1_alm_z, frame);
    bool follows = inbox->slice_parts[row] == 1 &&
                   inbox->slice_satellite[row] == satellite_of(raw.sat_system, raw.sat_number);
    inbox->slice_parts[row] = follows ? 2 : 0;
    inbox->slice[row].motion.position_ecef_m[2] = VALUE(rx1_alm_z, z_m);
    inbox->slice[row].healthy = raw.health == GNSS_RX1_ALM_Z_HEALTH_HEALTHY_CHOICE;
    return true;
}

/* The third frame completes an entry; it holds for the time mark of its epoch. */
static bool take_alm_v(struct inbox *inbox, int row, const struct can_frame *frame)
{
    UNPACK(rx1_alm_v, frame);
    int satellite = satellite_of(raw.sat_system, raw.sat_number);
    bool follows = inbox->slice_parts[row] == 2 && inbox->slice_satellite[row] == satellite;
    inbox->slice_parts[row] = 0;
    if (!follows || satellite == NO_SATELLITE || inbox->epoch.mark != WHOLE_MARK)
        return true;
    struct almanac_entry *entry = &inbox->slice[row];
    entry->motion.velocity_ecef_mps[0] = VALUE(rx1_alm_v, vx_mps);
    entry->motion.velocity_ecef_mps[1] = VALUE(rx1_alm_v, vy_mps);
    entry->motion.velocity_ecef_mps[2] = VALUE(rx1_alm_v, vz_mps);
    entry->t_ns = epoch_time_ns(&inbox->epoch);
    entry->known = true;
    inbox->almanac[satellite] = *entry;
    return true;
}

static bool take_time_gps(struct epoch *epoch, const struct can_frame *frame)
{
    UNPACK(time_gps, frame);
    if (raw.second >= S_PER_WEEK || raw.week > LAST_WEEK)
        return false;
    epoch->week = raw.week;
    epoch->second = raw.second;
    epoch->mark |= MARK_GPS;
    return true;
}

static bool take_time_fine(struct epoch *epoch, const struct can_frame *frame)
{
    UNPACK(time_fine, frame);
    if (raw.nanosecond >= NS_PER_S)
        return false;
    epoch->nanosecond = raw.nanosecond;
    epoch->mark_clock = raw.mark_clock;
    epoch->mark |= MARK_FINE;
    return true;
}

static bool take_q01(struct epoch *epoch, const struct can_frame *frame)
{
    UNPACK(att_q01, frame);
    epoch->q[0] = VALUE(att_q01, q0);
    epoch->q[1] = VALUE(att_q01, q1);
    epoch->attitude |= HAVE_Q01;
    return true;
}

static bool take_q23(struct epoch *epoch, const struct can_frame *frame)
{
    UNPACK(att_q23, frame);
    epoch->q[2] = VALUE(att_q23, q2);
    epoch->q[3] = VALUE(att_q23, q3);
    epoch->attitude |= HAVE_Q23;
    return true;
}

static bool take_attitude_rate(struct epoch *epoch, const struct can_frame *frame)
{
    UNPACK(att_rate, frame);
    epoch->rate_body_rps[0] = VALUE(att_rate, wx_rps);
    epoch->rate_body_rps[1] = VALUE(att_rate, wy_rps);
    epoch->rate_body_rps[2] = VALUE(att_rate, wz_rps);
    epoch->attitude |= HAVE_RATE;
    return true;
}

/* The layout of a heartbeat is the same for all nodes. */
static bool take_heartbeat(struct inbox *inbox, int node, const struct can_frame *frame)
{
    UNPACK(rx1_heartbeat, frame);
    inbox->other_contract[node] = raw.contract_hash != CONTRACT_HASH;
    return true;
}

bool decode(struct inbox *inbox, const struct can_frame *frame, struct meaning meaning)
{
    struct epoch *epoch = &inbox->epoch;
    int row = meaning.receiver - 1;
    if ((int)meaning.kind < CHANNEL_PARTS) {
        struct channel *channel = &epoch->receiver[row].channel[channel_of(frame)];
        channel->parts |= 1U << meaning.kind;
        return take_part[meaning.kind](channel, frame);
    }
    switch (meaning.kind) {
    case TAG: return take_tag(inbox, row, frame);
    case STATUS: epoch->receiver[row].status = true; return true;
    case ACK: return take_ack(inbox, row, frame);
    case ALM_XY: return take_alm_xy(inbox, row, frame);
    case ALM_Z: return take_alm_z(inbox, row, frame);
    case ALM_V: return take_alm_v(inbox, row, frame);
    case TIME_MARK: epoch->mark |= MARK_SESSION; return true;
    case TIME_GPS: return take_time_gps(epoch, frame);
    case TIME_FINE: return take_time_fine(epoch, frame);
    case ATT_Q01: return take_q01(epoch, frame);
    case ATT_Q23: return take_q23(epoch, frame);
    case ATT_RATE: return take_attitude_rate(epoch, frame);
    case HEARTBEAT: return take_heartbeat(inbox, meaning.node, frame);
    default: return false;
    }
}
