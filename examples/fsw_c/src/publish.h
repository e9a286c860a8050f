/* What this node says: navigation, commands, heartbeat, DONE. */
#ifndef PUBLISH_H
#define PUBLISH_H

#include <stdint.h>

#include "block.h"
#include "e2e.h"
#include "orders.h"
#include "solve.h"
#include "vehicle.h"

struct outbox {
    struct e2e_streams streams;
    struct block block;
    uint32_t epoch;
};

/* Takes from a fix what no frame can carry: its velocity with the drifts, or the whole fix. */
void publish_judge(struct fix *fix);

void publish_begin(struct outbox *outbox, uint32_t epoch);
void publish_fix(struct outbox *outbox, const struct vehicle *vehicle, const struct fix *fix);

/* Sends the orders that are due, and takes the mark off them: RELEASEs first. */
void publish_orders(struct outbox *outbox, const struct vehicle *vehicle, struct orders *orders);
void publish_heartbeat(struct outbox *outbox, unsigned state);
void publish_done(struct outbox *outbox, uint16_t session, uint32_t epoch);

#endif
