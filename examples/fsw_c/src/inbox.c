#include "inbox.h"

#include <string.h>

#include "decode.h"

const char *const reason_names[REASONS] = {
    "error, remote or extended frame", "wrong length", "unknown identifier", "corrupted", "mixed epoch",
    "repeated", "wrong sequence", "other contract", "names nothing",
};

static void refuse(struct inbox *inbox, enum reason reason) { inbox->refused[reason]++; }

bool inbox_sound(struct inbox *inbox, const struct can_frame *frame, struct meaning *meaning)
{
    if (frame->can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) {
        refuse(inbox, BAD_KIND);
        return false;
    }
    *meaning = meaning_of(frame->can_id);
    if (meaning->kind == UNKNOWN) {
        refuse(inbox, BAD_ID);
        return false;
    }
    if (frame->can_dlc != 8) {
        refuse(inbox, BAD_LENGTH);
        return false;
    }
    if (frame->data[0] != e2e_crc(frame->can_id, frame->data)) {
        refuse(inbox, BAD_CRC);
        return false;
    }
    return true;
}

void inbox_greet(struct inbox *inbox, const struct can_frame *frame, struct meaning meaning)
{
    if (!decode(inbox, frame, meaning))
        refuse(inbox, BAD_VALUE);
}

void inbox_open(struct inbox *inbox, uint32_t epoch)
{
    memset(&inbox->epoch, 0, sizeof inbox->epoch);
    memset(inbox->slice_parts, 0, sizeof inbox->slice_parts);
    inbox->epoch.number = epoch;
}

void inbox_take(struct inbox *inbox, const struct can_frame *frame, struct meaning meaning)
{
    unsigned item = has_channel(meaning.kind) ? channel_of(frame) : 0;
    if (meaning.kind == HEARTBEAT && inbox->other_contract[meaning.node])
        inbox_greet(inbox, frame, meaning); /* it may speak this contract again, though its epochs are not heard */
    if (frame->data[1] >> 4 != (inbox->epoch.number & 0x0F)) {
        refuse(inbox, BAD_EPOCH);
        return;
    }
    switch (e2e_check(&inbox->streams, frame->can_id, item, frame->data)) {
    case E2E_OK: break;
    case E2E_LOST: inbox->frames_lost++; break;
    case E2E_REPEATED: refuse(inbox, BAD_REPEATED); return;
    case E2E_WRONG_SEQUENCE: refuse(inbox, BAD_SEQUENCE); return;
    case E2E_CORRUPTED: refuse(inbox, BAD_CRC); return;
    }
    inbox->epoch.heard[meaning.node] = true;
    if (inbox->other_contract[meaning.node] && meaning.kind != HEARTBEAT)
        refuse(inbox, BAD_CONTRACT);
    else if (!decode(inbox, frame, meaning))
        refuse(inbox, BAD_VALUE);
}

void inbox_close(struct inbox *inbox)
{
    for (int node = 0; node < NODES; node++) {
        inbox->nodes_silent += inbox->known[node] && !inbox->epoch.heard[node];
        inbox->known[node] |= inbox->epoch.heard[node];
    }
}
