#include "follow.h"

#include "contract.h"
#include "gnss.h"

enum {
    QUIET_MS = 20,     /* real time: almanac and heartbeats come behind the last STATUS */
    DEADLINE_MS = 500, /* real time: a receiver's STATUS may be lost */
    BLIND_EPOCHS = 16  /* a SYNC is believed without its time mark so far ahead of the last one */
};

static void open_epoch(struct follow *follow, uint32_t epoch, int64_t now_ms)
{
    follow->open = true;
    follow->epoch = epoch;
    follow->statuses = 0;
    follow->heard = 0;
    follow->mark_ms = follow->last_ms = now_ms;
}

/* Another session is another run; so is epoch 0 behind a later one, because an emulator may start again under
 * the session it had. */
enum task follow_mark(struct follow *follow, uint16_t session, uint32_t epoch, int64_t now_ms)
{
    bool another = !follow->running || session != follow->session || (epoch == 0 && follow->epoch > 0);
    if (another) {
        unsigned long lost = follow->lost;
        *follow = (struct follow){.running = true, .first = true, .session = session, .lost = lost};
        open_epoch(follow, epoch, now_ms);
        return BEGIN;
    }
    if (epoch <= follow->epoch)
        return FRAME; /* repeated or replayed: for the counters to refuse */
    if (follow->open)
        return STEP_BEFORE;
    open_epoch(follow, epoch, now_ms);
    return OPEN;
}

static enum task on_sync(struct follow *follow, const struct gnss_bench_sync_t *sync)
{
    if (follow->open ? sync->epoch < follow->epoch : follow->answered && sync->epoch < follow->answered_epoch)
        return NOTHING;
    if (!follow->open && follow->answered && sync->epoch == follow->answered_epoch)
        return REPEAT;
    bool blind = !follow->open || sync->epoch > follow->epoch;
    if (blind && (sync->epoch <= follow->epoch || sync->epoch - follow->epoch > BLIND_EPOCHS))
        return NOTHING;
    if (blind)
        open_epoch(follow, sync->epoch, follow->last_ms);
    else if (sync->count > follow->heard)
        follow->lost += sync->count - follow->heard;
    follow->lockstep = true;
    return blind ? STEP_BLIND : STEP;
}

enum task follow_bench(struct follow *follow, const struct can_frame *frame)
{
    struct gnss_bench_sync_t sync;
    struct gnss_bench_end_t end;
    if (!follow->running || frame->can_dlc != 8)
        return NOTHING;
    if (frame->can_id == GNSS_BENCH_SYNC_FRAME_ID && gnss_bench_sync_unpack(&sync, frame->data, 8) == 0 &&
        sync.session == follow->session)
        return on_sync(follow, &sync);
    if (frame->can_id == GNSS_BENCH_END_FRAME_ID && gnss_bench_end_unpack(&end, frame->data, 8) == 0 &&
        end.session == follow->session) {
        follow->running = follow->open = false;
        return END;
    }
    return NOTHING;
}

void follow_heard(struct follow *follow, int64_t now_ms)
{
    follow->heard++;
    follow->last_ms = now_ms;
}

void follow_status(struct follow *follow, int receiver) { follow->statuses |= 1U << (receiver - 1); }

int64_t follow_due_ms(const struct follow *follow)
{
    const unsigned all = (1U << CONTRACT_RECEIVERS) - 1;
    int64_t deadline_ms = follow->mark_ms + DEADLINE_MS;
    int64_t quiet_ms = follow->last_ms + QUIET_MS;
    if (!follow->open || follow->lockstep || follow->first)
        return -1;
    return follow->statuses == all && quiet_ms < deadline_ms ? quiet_ms : deadline_ms;
}

void follow_stepped(struct follow *follow, bool synced)
{
    follow->open = false;
    follow->first = false;
    if (synced) {
        follow->answered = true;
        follow->answered_epoch = follow->epoch;
    }
}
