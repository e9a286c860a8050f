/* Commands under way: what each channel was told, what it answered, what is to be repeated. */
#ifndef ORDERS_H
#define ORDERS_H

#include <stdbool.h>
#include <stdint.h>

#include "contract.h"
#include "inbox.h"
#include "patent.h"
#include "vehicle.h"

enum duty { UNTOLD, FREE, IDLE, TRACKING }; /* FREE: searches by itself, because it was told so */

struct goal {
    enum duty duty;
    int satellite; /* TRACKING */
};

struct order {
    struct goal goal;   /* what the channel does, or will do once it answers */
    struct goal before; /* what it goes on doing if it refuses */
    bool pending;       /* no answer yet */
    bool due;           /* to be sent in this epoch */
    unsigned transaction;
    uint32_t sent_epoch;
};

struct orders {
    struct order order[MAX_RECEIVERS][MAX_CHANNELS];
    uint32_t barred_until[SATELLITES]; /* epoch: a refused satellite is left alone */
    unsigned next_transaction;
    uint32_t epochs_without_fix;
};

/* Takes the answers of an epoch. */
void orders_hear(struct orders *orders, const struct epoch *epoch);

/* Which satellites must be left alone in this epoch. */
void orders_barred(const struct orders *orders, uint32_t epoch, bool barred[SATELLITES]);

/* Where the craft is known: turns the difference between wishes and orders into new orders. */
void orders_follow(struct orders *orders, const struct vehicle *vehicle, const struct epoch *epoch,
                   const struct wish wish[MAX_RECEIVERS]);

/* Counts epochs without a fix; false: after too many of them the receivers are set free. */
bool orders_hold(struct orders *orders, const struct vehicle *vehicle, bool fixed);

/* Marks what has stayed unanswered as due again, and stamps what is due. */
void orders_send(struct orders *orders, uint32_t epoch);

#endif
