#include "flight.h"

#include <string.h>

#include "bench.h"
#include "gnss.h"
#include "measure.h"
#include "sky.h"

/* Another run: nothing of the last one is known but the vehicle. */
static void forget(struct flight *flight)
{
    memset(&flight->inbox, 0, sizeof flight->inbox);
    memset(&flight->orders, 0, sizeof flight->orders);
    memset(&flight->outbox, 0, sizeof flight->outbox);
    memset(&flight->fix, 0, sizeof flight->fix);
    memset(&flight->craft, 0, sizeof flight->craft);
    flight->craft_known = false;
    for (int a = 0; a < flight->vehicle.antennas; a++)
        flight->inbox.clock_domain[a] = flight->vehicle.antenna[a].clock_domain;
}

static void command(struct flight *flight)
{
    const struct epoch *epoch = &flight->inbox.epoch;
    struct wish wish[MAX_RECEIVERS];
    bool barred[SATELLITES];
    double body_from_ecef[3][3];
    struct sky sky;

    orders_hear(&flight->orders, epoch);
    bool holds = orders_hold(&flight->orders, &flight->vehicle, flight->fix.no_fix == 0);
    if (!holds) { /* too long ago to be carried on any further */
        flight->craft_known = false;
        memset(&flight->craft, 0, sizeof flight->craft);
    }
    if (flight->craft_known && epoch->mark == WHOLE_MARK && epoch_attitude(epoch, body_from_ecef)) {
        sky_look(&flight->inbox, flight->craft.position_ecef_m, &sky);
        orders_barred(&flight->orders, epoch->number, barred);
        patent_assign(&flight->vehicle, body_from_ecef, &sky, barred, wish);
        orders_follow(&flight->orders, &flight->vehicle, epoch, wish);
    }
    orders_send(&flight->orders, epoch->number);
}

/* Carries the craft's last known motion to the epoch's mark, if it has one. */
static void carry_on(struct flight *flight)
{
    if (flight->inbox.epoch.mark != WHOLE_MARK)
        return;
    int64_t now_ns = epoch_time_ns(&flight->inbox.epoch);
    if (flight->craft_known)
        motion_carry(&flight->craft, (double)(now_ns - flight->craft_ns) * 1e-9);
    flight->craft_ns = now_ns;
}

/* From where the craft is thought to be; where that leads nowhere, from the Earth's centre. */
static void find_fix(struct flight *flight)
{
    static const double centre_m[3] = {0.0, 0.0, 0.0};
    solve(&flight->vehicle, &flight->inbox, flight->craft.position_ecef_m, &flight->fix);
    if (flight->craft_known && (flight->fix.no_fix == GNSS_NAV_STATUS_NO_FIX_NO_CONVERGENCE_CHOICE ||
                                flight->fix.no_fix == GNSS_NAV_STATUS_NO_FIX_SINGULAR_GEOMETRY_CHOICE))
        solve(&flight->vehicle, &flight->inbox, centre_m, &flight->fix);
}

static void withdraw(struct fix *fix, unsigned reason)
{
    memset(fix, 0, sizeof *fix);
    fix->no_fix = reason;
}

/* A mark that a receiver's clock showed: the fix is of the latch, mark less that clock's offset, and is carried
 * along the orbit to the mark. */
static void bring_to_mark(struct flight *flight)
{
    struct fix *fix = &flight->fix;
    unsigned clock = flight->inbox.epoch.mark_clock;
    if (clock == 0 || fix->no_fix != 0)
        return;
    if (clock > CLOCK_ITEMS || !(fix->items >> (clock - 1) & 1U)) {
        withdraw(fix, GNSS_NAV_STATUS_NO_FIX_TOO_FEW_SATELLITES_CHOICE);
        return;
    }
    if (!fix->has_velocity && !flight->craft_known) {
        withdraw(fix, GNSS_NAV_STATUS_NO_FIX_NO_VELOCITY_CHOICE);
        return;
    }
    struct motion motion = flight->craft;
    memcpy(motion.position_ecef_m, fix->position_ecef_m, sizeof fix->position_ecef_m);
    if (fix->has_velocity)
        memcpy(motion.velocity_ecef_mps, fix->velocity_ecef_mps, sizeof fix->velocity_ecef_mps);
    motion_carry(&motion, fix->bias_m[clock - 1] / LIGHT_MPS);
    memcpy(fix->position_ecef_m, motion.position_ecef_m, sizeof fix->position_ecef_m);
    if (fix->has_velocity)
        memcpy(fix->velocity_ecef_mps, motion.velocity_ecef_mps, sizeof fix->velocity_ecef_mps);
}

/* A fix is where the craft is; one without velocity leaves the velocity carried on. */
static void settle(struct flight *flight)
{
    const struct fix *fix = &flight->fix;
    memcpy(flight->craft.position_ecef_m, fix->position_ecef_m, sizeof fix->position_ecef_m);
    if (fix->has_velocity)
        memcpy(flight->craft.velocity_ecef_mps, fix->velocity_ecef_mps, sizeof fix->velocity_ecef_mps);
    flight->craft_known |= fix->has_velocity;
}

/* One epoch: fix, assignment, answer. */
static void step(struct flight *flight, bool synced)
{
    struct outbox *outbox = &flight->outbox;
    uint32_t epoch = flight->inbox.epoch.number;

    inbox_close(&flight->inbox);
    carry_on(flight);
    find_fix(flight);
    bring_to_mark(flight);
    publish_judge(&flight->fix);
    bool fixed = flight->fix.no_fix == 0;
    if (fixed)
        settle(flight);
    command(flight);
    publish_begin(outbox, epoch);
    publish_fix(outbox, &flight->vehicle, &flight->fix);
    publish_orders(outbox, &flight->vehicle, &flight->orders);
    publish_heartbeat(outbox, fixed ? GNSS_FLIGHT_HEARTBEAT_STATE_RUNNING_CHOICE
                                    : GNSS_FLIGHT_HEARTBEAT_STATE_DEGRADED_CHOICE);
    if (synced)
        publish_done(outbox, flight->slave.at.session, epoch);
    slave_stepped(&flight->slave, synced);
    flight->epochs++;
    flight->fixes += fixed;
}

/* Takes a frame of the spacecraft's into the open epoch. */
static enum task take(struct flight *flight, const struct can_frame *frame, struct meaning meaning, int64_t now_ms)
{
    slave_heard(&flight->slave, now_ms);
    if (meaning.kind == STATUS)
        slave_status(&flight->slave, meaning.receiver);
    inbox_take(&flight->inbox, frame, meaning);
    return FRAME;
}

static void set_aside(struct flight *flight, const struct can_frame *frame)
{
    if (flight->asides < MOST_ASIDE)
        flight->aside[flight->asides++] = *frame;
    else
        flight->inbox.frames_lost++;
}

/* It is known now where the frames set aside belong: to the open epoch. The mark before them does where it is of
 * that epoch; else it is left out. */
static void take_asides(struct flight *flight, bool with_mark, int64_t now_ms)
{
    for (int i = with_mark ? 0 : 1; i < flight->asides; i++)
        take(flight, &flight->aside[i], meaning_of(flight->aside[i].can_id), now_ms);
    flight->asides = 0;
}

/* Opens the epoch that was set aside, with all that was. */
static void believe(struct flight *flight, int64_t now_ms)
{
    if (slave_believe(&flight->slave, now_ms))
        forget(flight);
    inbox_open(&flight->inbox, flight->slave.at.epoch);
    take_asides(flight, true, now_ms);
}

static enum task on_mark(struct flight *flight, const struct can_frame *frame, int64_t now_ms)
{
    struct gnss_time_mark_t mark;
    if (gnss_time_mark_unpack(&mark, frame->data, 8) != 0)
        return NOTHING;
    bool doubting = flight->slave.doubting;
    enum task task = slave_mark(&flight->slave, (struct label){mark.session, mark.epoch}, now_ms);
    if (task == BEGIN)
        forget(flight);
    if (doubting && (task == DOUBT || task == OPEN || task == STEP_BEFORE))
        take_asides(flight, false, now_ms); /* not borne out */
    if (task == BEGIN || task == OPEN)
        inbox_open(&flight->inbox, mark.epoch);
    return task;
}

/* Hears a frame of the spacecraft's. */
static enum task on_frame(struct flight *flight, const struct can_frame *frame, int64_t now_ms)
{
    struct meaning meaning;
    if (!inbox_sound(&flight->inbox, frame, &meaning)) {
        if (flight->slave.running)
            slave_heard(&flight->slave, now_ms);
        return flight->slave.running ? FRAME : NOTHING;
    }
    if (meaning.kind == TIME_MARK && !flight->inbox.other_contract[NODE_TIME]) {
        enum task task = on_mark(flight, frame, now_ms);
        if (task == STEP_BEFORE || task == STEP_OLD || task == BELIEVE || task == NOTHING)
            return task;
    }
    if (!flight->slave.running) {
        if (meaning.kind == HEARTBEAT)
            inbox_greet(&flight->inbox, frame, meaning);
        return NOTHING;
    }
    if (!flight->slave.doubting)
        return take(flight, frame, meaning, now_ms);
    set_aside(flight, frame);
    return FRAME;
}

bool flight_hear(struct flight *flight, const struct can_frame *frame, int64_t now_ms, bool *again)
{
    enum task task =
        is_bench(frame) ? slave_bench(&flight->slave, frame) : on_frame(flight, frame, now_ms);
    flight->heard_ms = now_ms;
    bool old = task == STEP_BEFORE || task == STEP_OLD;
    *again = old || task == BELIEVE;
    if (task == BELIEVE)
        believe(flight, now_ms);
    if (task == STEP_BLIND)
        inbox_open(&flight->inbox, flight->slave.at.epoch);
    if (task == STEP || task == STEP_BLIND)
        take_asides(flight, false, now_ms); /* the mark before them was a stray */
    if (task == STEP || task == STEP_BLIND || old)
        step(flight, !old);
    if (task == END) {
        flight->ended = true;
        flight->asides = 0;
    }
    return task == STEP || task == STEP_BLIND || old || task == REPEAT;
}

bool flight_wait(struct flight *flight, int64_t now_ms)
{
    int64_t due_ms = slave_due_ms(&flight->slave);
    if (due_ms < 0 || now_ms < due_ms)
        return false;
    take_asides(flight, false, now_ms);
    flight->slave.doubting = false;
    step(flight, false);
    return true;
}

bool flight_is_waiting(const struct flight *flight, int64_t now_ms)
{
    return !flight->slave.running || now_ms - flight->heard_ms >= MS_SILENCE;
}

struct can_frame flight_greeting(void)
{
    struct gnss_flight_heartbeat_t raw = {
        .state = GNSS_FLIGHT_HEARTBEAT_STATE_READY_CHOICE, .contract_hash = CONTRACT_HASH};
    struct can_frame frame = {.can_id = GNSS_FLIGHT_HEARTBEAT_FRAME_ID, .can_dlc = 8};
    (void)gnss_flight_heartbeat_pack(frame.data, &raw, 8); /* fails only for a buffer below 8 bytes */
    frame.data[0] = e2e_crc(frame.can_id, frame.data);
    return frame;
}
