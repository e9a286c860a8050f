#include "bench.h"

#include "e2e.h"
#include "gnss.h"

enum { NEAR = 1 };

bool is_bench(const struct can_frame *frame)
{
    return frame->can_id >= GNSS_BENCH_SYNC_FRAME_ID && frame->can_id <= GNSS_BENCH_END_FRAME_ID;
}

bool bench_believed(const struct can_frame *frame, uint16_t session, uint32_t expected, struct bench *bench)
{
    struct gnss_bench_sync_t raw; /* all bench frames are laid out alike; an END has its reason where others count */
    if (frame->can_dlc != 8 || frame->data[0] != e2e_crc(frame->can_id, frame->data) ||
        gnss_bench_sync_unpack(&raw, frame->data, 8) != 0)
        return false;
    uint16_t ahead = (uint16_t)(raw.epoch - (uint16_t)expected + NEAR); /* modulo 65536, as the epoch is carried */
    bool intact = raw.e2e_counter < COUNTERS && raw.epoch_mod16 == (raw.epoch & 0x0F);
    if (!intact || raw.session != session || ahead > 2 * NEAR || (expected == 0 && ahead < NEAR))
        return false;
    *bench = (struct bench){expected + ahead - NEAR, raw.count};
    return true;
}
