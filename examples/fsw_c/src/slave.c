#include "slave.h"

#include "bench.h"
#include "contract.h"
#include "gnss.h"

enum {
    QUIET_MS = 20,     /* real time: almanac and heartbeats come behind the last STATUS */
    DEADLINE_MS = 500, /* real time: a receiver's STATUS may be lost */
    LEAD = 16          /* a time mark leads on by so many epochs at most */
};

static bool same(struct label a, struct label b) { return a.session == b.session && a.epoch == b.epoch; }

static bool leads(struct label from, struct label to, uint32_t most)
{
    return to.session == from.session && to.epoch > from.epoch && to.epoch - from.epoch <= most;
}

/* Whether a mark needs nothing more to be believed. */
static bool leads_on(const struct slave *slave, struct label mark)
{
    return slave->lockstep ? !slave->open && leads(slave->at, mark, 1) : leads(slave->at, mark, LEAD);
}

/* What follows has borne out the epoch set aside; the open one, whose SYNC was lost, is stepped first. */
static enum task borne_out(const struct slave *slave)
{
    return slave->open && slave->doubt.session == slave->at.session && slave->doubt.epoch > slave->at.epoch
               ? STEP_OLD
               : BELIEVE;
}

static void open_epoch(struct slave *slave, struct label label, int64_t now_ms)
{
    slave->open = true;
    slave->refused += slave->doubting;
    slave->doubting = slave->answered = false;
    slave->at = label;
    slave->statuses = 0;
    slave->heard = 0;
    slave->mark_ms = slave->last_ms = now_ms;
}

static void begin(struct slave *slave, struct label label, int64_t now_ms)
{
    *slave = (struct slave){.running = true, .first = true, .lost = slave->lost, .refused = slave->refused};
    open_epoch(slave, label, now_ms);
}

/* The run's first mark begins it. Later ones lead on; any other may be a stray or another run's (of another session,
 * back, far ahead; where SYNC closes epochs, any but the next, and any in an open one) and is believed when its own SYNC
 * comes, or a mark that leads on from it, before anything of the run at hand. */
enum task slave_mark(struct slave *slave, struct label mark, int64_t now_ms)
{
    if (!slave->running) {
        begin(slave, mark, now_ms);
        return BEGIN;
    }
    if (slave->open && same(mark, slave->at)) {
        slave->refused++; /* repeated */
        return NOTHING;
    }
    if (leads_on(slave, mark)) {
        if (slave->open)
            return STEP_BEFORE;
        open_epoch(slave, mark, now_ms);
        return OPEN;
    }
    bool own = slave->lockstep && mark.session == slave->at.session; /* where SYNC closes epochs it must come */
    if (slave->doubting && !own && leads(slave->doubt, mark, LEAD))
        return borne_out(slave);
    slave->refused += slave->doubting;
    slave->doubting = true;
    slave->doubt = mark;
    return DOUBT;
}

bool slave_believe(struct slave *slave, int64_t now_ms)
{
    struct label label = slave->doubt;
    slave->doubting = false;
    bool another = label.session != slave->at.session || label.epoch <= slave->at.epoch;
    if (another)
        begin(slave, label, now_ms);
    else
        open_epoch(slave, label, now_ms);
    return another;
}

static enum task on_sync(struct slave *slave, const struct can_frame *frame)
{
    struct bench sync;
    uint32_t expected = slave->open ? slave->at.epoch : slave->at.epoch + 1;
    bool own = bench_believed(frame, slave->at.session, expected, &sync);
    bool at_hand = own && slave->open && sync.epoch == slave->at.epoch;
    if (!at_hand && slave->doubting) {
        struct bench other;
        if (bench_believed(frame, slave->doubt.session, slave->doubt.epoch, &other) &&
            other.epoch == slave->doubt.epoch)
            return borne_out(slave);
    }
    if (own && !slave->open && slave->answered && sync.epoch == slave->at.epoch)
        return REPEAT;
    if (!own || (slave->open ? sync.epoch < slave->at.epoch : sync.epoch <= slave->at.epoch)) {
        slave->refused++;
        return NOTHING;
    }
    if (!at_hand)
        open_epoch(slave, (struct label){slave->at.session, sync.epoch}, slave->last_ms);
    else if (sync.count > slave->heard)
        slave->lost += sync.count - slave->heard;
    slave->lockstep = true;
    return at_hand ? STEP : STEP_BLIND;
}

enum task slave_bench(struct slave *slave, const struct can_frame *frame)
{
    struct bench end;
    if (!slave->running || frame->can_id == GNSS_BENCH_DONE_FRAME_ID)
        return NOTHING;
    if (frame->can_id == GNSS_BENCH_SYNC_FRAME_ID)
        return on_sync(slave, frame);
    if (frame->can_id == GNSS_BENCH_END_FRAME_ID &&
        bench_believed(frame, slave->at.session, slave->at.epoch + 1, &end)) {
        slave->running = slave->open = slave->doubting = false;
        return END;
    }
    slave->refused++;
    return NOTHING;
}

void slave_heard(struct slave *slave, int64_t now_ms)
{
    slave->heard++;
    slave->last_ms = now_ms;
}

void slave_status(struct slave *slave, int receiver) { slave->statuses |= 1U << (receiver - 1); }

int64_t slave_due_ms(const struct slave *slave)
{
    const unsigned all = (1U << CONTRACT_RECEIVERS) - 1;
    int64_t deadline_ms = slave->mark_ms + DEADLINE_MS;
    int64_t quiet_ms = slave->last_ms + QUIET_MS;
    if (!slave->open || slave->lockstep || slave->first)
        return -1;
    return slave->statuses == all && quiet_ms < deadline_ms ? quiet_ms : deadline_ms;
}

void slave_stepped(struct slave *slave, bool synced)
{
    slave->open = false;
    slave->first = false;
    slave->answered = synced;
    if (synced) {
        slave->refused += slave->doubting;
        slave->doubting = false;
    }
}
