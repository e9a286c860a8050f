/* Limits and names of the bus contract that a DBC does not carry. Source: docs/contract.md. */
#ifndef CONTRACT_H
#define CONTRACT_H

#include "contract_hash.h"

enum {
    MAX_RECEIVERS = 8,
    MAX_CHANNELS = 32,
    MAX_DOMAINS = 8,
    GLONASS_OFFSET = 8, /* ClockItem: one clock for each domain, then the offset */
    CLOCK_ITEMS = 9,
    STANDARD_IDS = 2048
};

/* Satellites of the two systems this software uses are counted system * 64 + number. */
enum { NUMBERS = 64, GPS = 0, GLONASS = 1, SATELLITES = 2 * NUMBERS, NO_SATELLITE = -1 };

static inline int satellite_of(unsigned system, unsigned number)
{
    return system <= GLONASS && number > 0 && number < NUMBERS ? (int)(system * NUMBERS + number) : NO_SATELLITE;
}

static inline int system_of(int satellite) { return satellite / NUMBERS; }
static inline int number_of(int satellite) { return satellite % NUMBERS; }

/* Physical constants of the contract's formulas. */
#define LIGHT_MPS 299792458.0
#define EARTH_RATE_RPS 7.2921151467e-5
#define EARTH_MU_M3PS2 3.986004418e14

#endif
