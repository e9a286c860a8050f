/* The bench's own frames: the one rule by which one is believed. */
#ifndef BENCH_H
#define BENCH_H

#include <linux/can.h>
#include <stdbool.h>
#include <stdint.h>

struct bench {
    uint32_t epoch; /* in full */
    unsigned count; /* frames in the block, or the reason of an end */
};

bool is_bench(const struct can_frame *frame);

/* Whether a bench frame counts: eight bytes, intact, of the session, of the expected epoch or one beside it. */
bool bench_believed(const struct can_frame *frame, uint16_t session, uint32_t expected, struct bench *bench);

#endif
