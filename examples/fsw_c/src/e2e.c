#include "e2e.h"

enum { POLYNOMIAL = 0x1D, MOST_LOST = 2 };

static uint8_t crc_byte(uint8_t crc, uint8_t byte)
{
    crc ^= byte;
    for (int bit = 0; bit < 8; bit++)
        crc = (uint8_t)(crc & 0x80 ? crc << 1 ^ POLYNOMIAL : crc << 1);
    return crc;
}

uint8_t e2e_crc(uint32_t id, const uint8_t data[8])
{
    uint8_t crc = crc_byte(crc_byte(0, (uint8_t)(id & 0xFF)), (uint8_t)(id >> 8));
    for (int i = 1; i < 8; i++)
        crc = crc_byte(crc, data[i]);
    return crc;
}

enum e2e_verdict e2e_check(struct e2e_streams *streams, uint32_t id, unsigned item, const uint8_t data[8])
{
    uint8_t *last = &streams->last[id % STANDARD_IDS][item % MAX_CHANNELS];
    int counter = data[1] & 0x0F;
    if (counter >= COUNTERS)
        return E2E_CORRUPTED;
    int step = *last == 0 ? 1 : (counter - (*last - 1) + COUNTERS) % COUNTERS;
    *last = (uint8_t)(counter + 1);
    if (step == 0)
        return E2E_REPEATED;
    if (step == 1)
        return E2E_OK;
    return step <= 1 + MOST_LOST ? E2E_LOST : E2E_WRONG_SEQUENCE;
}

void e2e_protect(struct e2e_streams *streams, uint32_t id, unsigned item, uint32_t epoch, uint8_t data[8])
{
    uint8_t *last = &streams->last[id % STANDARD_IDS][item % MAX_CHANNELS];
    uint8_t counter = (uint8_t)(*last % COUNTERS); /* last holds 1 + counter: 0 starts at 0, 15 wraps to 0 */
    *last = (uint8_t)(counter + 1);
    data[1] = (uint8_t)((epoch & 0x0F) << 4 | counter);
    data[0] = e2e_crc(id, data);
}
