#include "frames.h"

#include "contract.h"
#include "gnss.h"

/* A kind that repeats for each receiver stands `step` identifiers apart. */
struct family {
    enum kind kind;
    uint32_t first;
    uint32_t step;
};

static const struct family per_receiver[] = {
    {ACK, GNSS_RX1_ACK_FRAME_ID, 0x01},
    {RANGE, GNSS_RX1_RANGE_FRAME_ID, 0x10},
    {RATE, GNSS_RX1_RATE_FRAME_ID, 0x10},
    {PHASE, GNSS_RX1_PHASE_FRAME_ID, 0x10},
    {SV_X, GNSS_RX1_SV_X_FRAME_ID, 0x10},
    {SV_Y, GNSS_RX1_SV_Y_FRAME_ID, 0x10},
    {SV_Z, GNSS_RX1_SV_Z_FRAME_ID, 0x10},
    {SV_VX, GNSS_RX1_SV_VX_FRAME_ID, 0x10},
    {SV_VY, GNSS_RX1_SV_VY_FRAME_ID, 0x10},
    {SV_VZ, GNSS_RX1_SV_VZ_FRAME_ID, 0x10},
    {SV_CLOCK, GNSS_RX1_SV_CLOCK_FRAME_ID, 0x10},
    {TAG, GNSS_RX1_TAG_FRAME_ID, 0x10},
    {STATUS, GNSS_RX1_STATUS_FRAME_ID, 0x10},
    {ALM_XY, GNSS_RX1_ALM_XY_FRAME_ID, 0x10},
    {ALM_Z, GNSS_RX1_ALM_Z_FRAME_ID, 0x10},
    {ALM_V, GNSS_RX1_ALM_V_FRAME_ID, 0x10},
    {HEARTBEAT, GNSS_RX1_HEARTBEAT_FRAME_ID, 0x01},
};

struct single {
    uint32_t id;
    struct meaning meaning;
};

static const struct single singles[] = {
    {GNSS_TIME_MARK_FRAME_ID, {TIME_MARK, 0, NODE_TIME}},
    {GNSS_TIME_GPS_FRAME_ID, {TIME_GPS, 0, NODE_TIME}},
    {GNSS_TIME_FINE_FRAME_ID, {TIME_FINE, 0, NODE_TIME}},
    {GNSS_ATT_Q01_FRAME_ID, {ATT_Q01, 0, NODE_ATT}},
    {GNSS_ATT_Q23_FRAME_ID, {ATT_Q23, 0, NODE_ATT}},
    {GNSS_ATT_RATE_FRAME_ID, {ATT_RATE, 0, NODE_ATT}},
    {GNSS_ATT_HEARTBEAT_FRAME_ID, {HEARTBEAT, 0, NODE_ATT}},
    {GNSS_TIME_HEARTBEAT_FRAME_ID, {HEARTBEAT, 0, NODE_TIME}},
};

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

struct meaning meaning_of(uint32_t id)
{
    for (size_t i = 0; i < COUNT(per_receiver); i++) {
        const struct family *family = &per_receiver[i];
        uint32_t distance = id - family->first; /* wraps to something large below the first */
        if (distance % family->step == 0 && distance / family->step < CONTRACT_RECEIVERS) {
            int receiver = 1 + (int)(distance / family->step);
            return (struct meaning){family->kind, receiver, receiver};
        }
    }
    for (size_t i = 0; i < COUNT(singles); i++)
        if (singles[i].id == id)
            return singles[i].meaning;
    return (struct meaning){UNKNOWN, 0, 0};
}

bool has_channel(enum kind kind)
{
    return (int)kind < CHANNEL_PARTS || kind == ACK;
}
