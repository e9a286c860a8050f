/* AUTOSAR E2E Profile 11, variant A, as docs/contract.md has it. */
#ifndef E2E_H
#define E2E_H

#include <stdint.h>

#include "contract.h"

enum { COUNTERS = 15 }; /* 0 to 14; 15 is never sent */

enum e2e_verdict { E2E_OK, E2E_LOST, E2E_REPEATED, E2E_WRONG_SEQUENCE, E2E_CORRUPTED };

/* Counters of all streams, by identifier and item (channel, receiver, clock; 0 where there is none).
 * 0: nothing heard or sent yet; else 1 + the last counter. All zero is a fresh start. */
struct e2e_streams {
    uint8_t last[STANDARD_IDS][MAX_CHANNELS];
};

uint8_t e2e_crc(uint32_t id, const uint8_t data[8]);

/* Judges a frame by its counter and notes it; its CRC was found sound before. */
enum e2e_verdict e2e_check(struct e2e_streams *streams, uint32_t id, unsigned item, const uint8_t data[8]);

/* Writes epoch, next counter and CRC into a frame to be sent. */
void e2e_protect(struct e2e_streams *streams, uint32_t id, unsigned item, uint32_t epoch, uint8_t data[8]);

#endif
