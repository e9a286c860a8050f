#include "slave.h"

#include "contract.h"
#include "gnss.h"

enum {
    QUIET_MS = 20,     /* real time: almanac and heartbeats come behind the last STATUS */
    DEADLINE_MS = 500, /* real time: a receiver's STATUS may be lost */
    BLIND_EPOCHS = 16  /* a SYNC is believed without its time mark so far ahead of the last one */
};

static void open_epoch(struct slave *slave, uint32_t epoch, int64_t now_ms)
{
    slave->open = true;
    slave->epoch = epoch;
    slave->statuses = 0;
    slave->heard = 0;
    slave->mark_ms = slave->last_ms = now_ms;
}

/* Another session is another run; so is epoch 0 behind a later one, because an emulator may start again under
 * the session it had. */
enum task slave_mark(struct slave *slave, uint16_t session, uint32_t epoch, int64_t now_ms)
{
    bool another = !slave->running || session != slave->session || (epoch == 0 && slave->epoch > 0);
    if (another) {
        unsigned long lost = slave->lost;
        *slave = (struct slave){.running = true, .first = true, .session = session, .lost = lost};
        open_epoch(slave, epoch, now_ms);
        return BEGIN;
    }
    if (epoch <= slave->epoch)
        return FRAME; /* repeated or replayed: for the counters to refuse */
    if (slave->open)
        return STEP_BEFORE;
    open_epoch(slave, epoch, now_ms);
    return OPEN;
}

static enum task on_sync(struct slave *slave, const struct gnss_bench_sync_t *sync)
{
    if (slave->open ? sync->epoch < slave->epoch : slave->answered && sync->epoch < slave->answered_epoch)
        return NOTHING;
    if (!slave->open && slave->answered && sync->epoch == slave->answered_epoch)
        return REPEAT;
    bool blind = !slave->open || sync->epoch > slave->epoch;
    if (blind && (sync->epoch <= slave->epoch || sync->epoch - slave->epoch > BLIND_EPOCHS))
        return NOTHING;
    if (blind)
        open_epoch(slave, sync->epoch, slave->last_ms);
    else if (sync->count > slave->heard)
        slave->lost += sync->count - slave->heard;
    slave->lockstep = true;
    return blind ? STEP_BLIND : STEP;
}

enum task slave_bench(struct slave *slave, const struct can_frame *frame)
{
    struct gnss_bench_sync_t sync;
    struct gnss_bench_end_t end;
    if (!slave->running || frame->can_dlc != 8)
        return NOTHING;
    if (frame->can_id == GNSS_BENCH_SYNC_FRAME_ID && gnss_bench_sync_unpack(&sync, frame->data, 8) == 0 &&
        sync.session == slave->session)
        return on_sync(slave, &sync);
    if (frame->can_id == GNSS_BENCH_END_FRAME_ID && gnss_bench_end_unpack(&end, frame->data, 8) == 0 &&
        end.session == slave->session) {
        slave->running = slave->open = false;
        return END;
    }
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
    if (synced) {
        slave->answered = true;
        slave->answered_epoch = slave->epoch;
    }
}
