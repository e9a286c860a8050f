#include "orders.h"

#include "gnss.h"

enum { REPEAT_AFTER = 2, BAR_FOR = 30, FREE_AFTER = 120, TRANSACTIONS = 4096 }; /* epochs; numbers */

void orders_hear(struct orders *orders, const struct epoch *epoch)
{
    for (int i = 0; i < epoch->acks; i++) {
        const struct ack *ack = &epoch->ack[i];
        struct order *order = &orders->order[ack->receiver - 1][ack->channel];
        if (!order->pending || order->transaction != ack->transaction)
            continue;
        order->pending = false;
        if (ack->result == GNSS_RX1_ACK_RESULT_ACCEPTED_CHOICE)
            continue;
        if (order->goal.duty == TRACKING)
            orders->barred_until[order->goal.satellite] = epoch->number + BAR_FOR;
        order->goal = order->before;
    }
}

void orders_barred(const struct orders *orders, uint32_t epoch, bool barred[SATELLITES])
{
    for (int s = 0; s < SATELLITES; s++)
        barred[s] = orders->barred_until[s] > epoch;
}

/* A new order replaces one that is still unanswered. */
static void tell(struct orders *orders, struct order *order, enum duty duty, int satellite)
{
    if (!order->pending)
        order->before = order->goal;
    order->goal = (struct goal){duty, satellite};
    order->pending = order->due = true;
    order->transaction = orders->next_transaction;
    orders->next_transaction = (orders->next_transaction + 1) % TRANSACTIONS;
}

/* Index of the satellite in the wish, or -1. */
static int wished(const struct wish *wish, int satellite)
{
    for (int i = 0; i < wish->count; i++)
        if (wish->satellite[i] == satellite)
            return i;
    return -1;
}

/* Channels that do what is wished go on; one that found a wished satellite by itself is told to keep it. */
static void keep(struct orders *orders, struct order row[MAX_CHANNELS], int channels,
                 const struct channel heard[MAX_CHANNELS], const struct wish *wish, bool served[SATELLITES],
                 bool busy[MAX_CHANNELS])
{
    for (int k = 0; k < channels; k++) {
        int i = row[k].goal.duty == TRACKING ? wished(wish, row[k].goal.satellite) : -1;
        if (i < 0 || served[i])
            continue;
        served[i] = busy[k] = true;
        bool strays = heard[k].parts == ALL_PARTS && heard[k].satellite != row[k].goal.satellite;
        if (strays && !row[k].pending)
            tell(orders, &row[k], TRACKING, row[k].goal.satellite);
    }
    for (int k = 0; k < channels; k++) {
        bool by_itself = !busy[k] && row[k].goal.duty <= FREE && heard[k].parts == ALL_PARTS;
        int i = by_itself ? wished(wish, heard[k].satellite) : -1;
        if (i < 0 || served[i])
            continue;
        served[i] = busy[k] = true;
        tell(orders, &row[k], TRACKING, heard[k].satellite);
    }
}

/* A channel for a new satellite: an idle one first, then any that is not busy; -1 where there is none. */
static int spare(const struct order row[MAX_CHANNELS], int channels, const bool busy[MAX_CHANNELS])
{
    int any = -1;
    for (int k = 0; k < channels; k++) {
        if (busy[k])
            continue;
        if (row[k].goal.duty == IDLE)
            return k;
        if (any < 0)
            any = k;
    }
    return any;
}

void orders_follow(struct orders *orders, const struct vehicle *vehicle, const struct epoch *epoch,
                   const struct wish wish[MAX_RECEIVERS])
{
    for (int a = 0; a < vehicle->antennas; a++) {
        bool served[SATELLITES] = {false}, busy[MAX_CHANNELS] = {false};
        struct order *row = orders->order[a];
        int channels = vehicle->antenna[a].channels;
        keep(orders, row, channels, epoch->receiver[a].channel, &wish[a], served, busy);
        for (int i = 0; i < wish[a].count; i++) {
            int k = served[i] ? -1 : spare(row, channels, busy);
            if (k < 0)
                continue;
            busy[k] = true;
            tell(orders, &row[k], TRACKING, wish[a].satellite[i]);
        }
        for (int k = 0; k < channels; k++)
            if (!busy[k] && row[k].goal.duty != IDLE)
                tell(orders, &row[k], IDLE, NO_SATELLITE);
    }
}

bool orders_hold(struct orders *orders, const struct vehicle *vehicle, bool fixed)
{
    if (fixed)
        orders->epochs_without_fix = 0;
    else if (orders->epochs_without_fix <= FREE_AFTER)
        orders->epochs_without_fix++;
    for (int a = 0; a < vehicle->antennas && orders->epochs_without_fix == FREE_AFTER; a++)
        for (int k = 0; k < vehicle->antenna[a].channels; k++)
            tell(orders, &orders->order[a][k], FREE, NO_SATELLITE);
    return orders->epochs_without_fix < FREE_AFTER;
}

void orders_send(struct orders *orders, uint32_t epoch)
{
    for (int a = 0; a < MAX_RECEIVERS; a++) {
        for (int k = 0; k < MAX_CHANNELS; k++) {
            struct order *order = &orders->order[a][k];
            if (order->pending && !order->due)
                order->due = epoch - order->sent_epoch >= REPEAT_AFTER;
            if (order->due)
                order->sent_epoch = epoch;
        }
    }
}
