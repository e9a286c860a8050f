#include "intake.h"

#include <string.h>

#include "decode.h"

const char *const reason_names[REASONS] = {
    "error, remote or extended frame", "wrong length", "unknown identifier", "corrupted", "mixed epoch",
    "repeated", "wrong sequence", "other contract", "names nothing",
};

static void refuse(struct intake *intake, enum reason reason) { intake->refused[reason]++; }

bool intake_sound(struct intake *intake, const struct can_frame *frame, struct meaning *meaning)
{
    if (frame->can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) {
        refuse(intake, BAD_KIND);
        return false;
    }
    *meaning = meaning_of(frame->can_id);
    if (meaning->kind == UNKNOWN) {
        refuse(intake, BAD_ID);
        return false;
    }
    if (frame->can_dlc != 8) {
        refuse(intake, BAD_LENGTH);
        return false;
    }
    if (frame->data[0] != e2e_crc(frame->can_id, frame->data)) {
        refuse(intake, BAD_CRC);
        return false;
    }
    return true;
}

void intake_greet(struct intake *intake, const struct can_frame *frame, struct meaning meaning)
{
    if (!decode(intake, frame, meaning))
        refuse(intake, BAD_VALUE);
}

void intake_open(struct intake *intake, uint32_t epoch)
{
    memset(&intake->epoch, 0, sizeof intake->epoch);
    memset(intake->slice_parts, 0, sizeof intake->slice_parts);
    intake->epoch.number = epoch;
}

void intake_take(struct intake *intake, const struct can_frame *frame, struct meaning meaning)
{
    unsigned item = has_channel(meaning.kind) ? channel_of(frame) : 0;
    if (frame->data[1] >> 4 != (intake->epoch.number & 0x0F)) {
        refuse(intake, BAD_EPOCH);
        return;
    }
    switch (e2e_check(&intake->streams, frame->can_id, item, frame->data)) {
    case E2E_OK: break;
    case E2E_LOST: intake->frames_lost++; break;
    case E2E_REPEATED: refuse(intake, BAD_REPEATED); return;
    case E2E_WRONG_SEQUENCE: refuse(intake, BAD_SEQUENCE); return;
    case E2E_CORRUPTED: refuse(intake, BAD_CRC); return;
    }
    intake->epoch.heard[meaning.node] = true;
    if (intake->other_contract[meaning.node] && meaning.kind != HEARTBEAT)
        refuse(intake, BAD_CONTRACT);
    else if (!decode(intake, frame, meaning))
        refuse(intake, BAD_VALUE);
}

void intake_close(struct intake *intake)
{
    for (int node = 0; node < NODES; node++) {
        intake->nodes_silent += intake->known[node] && !intake->epoch.heard[node];
        intake->known[node] |= intake->epoch.heard[node];
    }
}
