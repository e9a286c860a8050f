/* Ways onto a bus: the bench's own socket, or SocketCAN. */
#ifndef BUS_H
#define BUS_H

#include <linux/can.h>
#include <stddef.h>

enum { BUS_BATCH = 1024 };

struct bus {
    int descriptor;
    int is_stream;                      /* embedded: frames are concatenated on a byte stream */
    size_t rest;                        /* bytes of a frame that has not come whole yet */
    unsigned char pending[BUS_BATCH * sizeof(struct can_frame)];
};

enum { BUS_NOT_YET = 1 }; /* nobody serves the socket: whoever does may be about to begin */

/* Opens `embedded:PATH` or `socketcan:INTERFACE`; 0, or -1 or BUS_NOT_YET with one line for people in `why`. */
int bus_open(struct bus *bus, const char *spec, char *why, size_t size);

/* Waits at most `timeout_ms` and takes what has come, up to BUS_BATCH frames: their number, 0 for none (or a
 * signal), -1 when the bus is gone. */
int bus_receive(struct bus *bus, struct can_frame frames[BUS_BATCH], int timeout_ms);

/* Sends all frames, waiting where the bus is full; 0, or -1 when the bus is gone. */
int bus_send(struct bus *bus, const struct can_frame *frames, int count);

void bus_close(struct bus *bus);

#endif
