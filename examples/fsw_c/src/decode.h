/* From payloads to numbers with units. */
#ifndef DECODE_H
#define DECODE_H

#include "inbox.h"

/* Channel of a frame of a channel's; its place is the same in all of them. */
unsigned channel_of(const struct can_frame *frame);

/* Takes an accepted frame into the epoch; false where its numbers name nothing. */
bool decode(struct inbox *inbox, const struct can_frame *frame, struct meaning meaning);

#endif
