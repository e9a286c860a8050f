#include "bus.h"

#include <errno.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#ifndef SO_RCVBUFFORCE
#define SO_RCVBUFFORCE 33 /* Linux: as SO_RCVBUF, past rmem_max, for root */
#endif

enum { RECEIVE_BUFFER_BYTES = 16 << 20, MOST_PAUSES = 2000 };

/* Whether a socket may still appear: its folder is there. */
static bool may_come(const struct sockaddr_un *address)
{
    char folder[sizeof address->sun_path];
    strcpy(folder, address->sun_path);
    char *slash = strrchr(folder, '/');
    if (!slash)
        return true;
    slash[slash == folder] = 0; /* the root keeps its slash */
    return access(folder, F_OK) == 0;
}

static int open_embedded(const char *path, bool *not_yet, char *why, size_t size)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        snprintf(why, size, "bus embedded:%.60s...: path longer than %zu characters", path,
                 sizeof address.sun_path - 1);
        return -1;
    }
    strcpy(address.sun_path, path);
    int descriptor = socket(AF_UNIX, SOCK_STREAM, 0);
    if (descriptor >= 0 && connect(descriptor, (struct sockaddr *)&address, sizeof address) == 0)
        return descriptor;
    snprintf(why, size, "bus embedded:%s: %s", path, strerror(errno));
    *not_yet = descriptor >= 0 && (errno == ENOENT || errno == ECONNREFUSED) && may_come(&address);
    if (descriptor >= 0)
        close(descriptor);
    return -1;
}

/* vcan has no back-pressure: what does not fit into the receive buffer is lost. */
static void widen_receive_buffer(int descriptor)
{
    const int bytes = RECEIVE_BUFFER_BYTES;
    if (setsockopt(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
        (void)setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes); /* up to rmem_max */
}

static int open_socketcan(const char *interface, char *why, size_t size)
{
    struct sockaddr_can address = {.can_family = AF_CAN};
    address.can_ifindex = (int)if_nametoindex(interface);
    if (address.can_ifindex == 0) {
        snprintf(why, size, "bus socketcan:%s: no such CAN interface", interface);
        return -1;
    }
    int descriptor = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (descriptor >= 0) {
        widen_receive_buffer(descriptor);
        if (bind(descriptor, (struct sockaddr *)&address, sizeof address) == 0)
            return descriptor;
    }
    snprintf(why, size, "bus socketcan:%s: %s", interface, strerror(errno));
    if (descriptor >= 0)
        close(descriptor);
    return -1;
}

int bus_open(struct bus *bus, const char *spec, char *why, size_t size)
{
    static const char embedded[] = "embedded:", socketcan[] = "socketcan:";
    bool not_yet = false;
    bus->rest = 0;
    bus->is_stream = strncmp(spec, embedded, sizeof embedded - 1) == 0;
    if (bus->is_stream) {
        bus->descriptor = open_embedded(spec + sizeof embedded - 1, &not_yet, why, size);
    } else if (strncmp(spec, socketcan, sizeof socketcan - 1) == 0) {
        bus->descriptor = open_socketcan(spec + sizeof socketcan - 1, why, size);
    } else {
        snprintf(why, size, "bus '%s': allowed are embedded:PATH and socketcan:INTERFACE", spec);
        bus->descriptor = -1;
    }
    return bus->descriptor >= 0 ? 0 : not_yet ? BUS_NOT_YET : -1;
}

static int receive_stream(struct bus *bus, struct can_frame frames[BUS_BATCH])
{
    ssize_t got = read(bus->descriptor, bus->pending + bus->rest, sizeof bus->pending - bus->rest);
    if (got < 0)
        return errno == EINTR || errno == EAGAIN ? 0 : -1;
    if (got == 0)
        return -1;
    size_t have = bus->rest + (size_t)got;
    size_t count = have / sizeof frames[0];
    size_t used = count * sizeof frames[0];
    memcpy(frames, bus->pending, used);
    bus->rest = have - used;
    memmove(bus->pending, bus->pending + used, bus->rest);
    return (int)count;
}

static int receive_datagrams(struct bus *bus, struct can_frame frames[BUS_BATCH])
{
    int count = 0;
    while (count < BUS_BATCH) {
        ssize_t got = recv(bus->descriptor, &frames[count], sizeof frames[count], MSG_DONTWAIT);
        if (got < 0) {
            if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)
                break;
            return count ? count : -1;
        }
        if (got == (ssize_t)sizeof frames[count])
            count++;
    }
    return count;
}

int bus_receive(struct bus *bus, struct can_frame frames[BUS_BATCH], int timeout_ms)
{
    struct pollfd watched = {.fd = bus->descriptor, .events = POLLIN};
    int ready = poll(&watched, 1, timeout_ms);
    if (ready < 0)
        return errno == EINTR ? 0 : -1;
    if (ready == 0)
        return 0;
    return bus->is_stream ? receive_stream(bus, frames) : receive_datagrams(bus, frames);
}

static int send_stream(struct bus *bus, const char *bytes, size_t left)
{
    while (left > 0) {
        ssize_t sent = send(bus->descriptor, bytes, left, MSG_NOSIGNAL);
        if (sent < 0 && errno != EINTR)
            return -1;
        if (sent > 0) {
            bytes += sent;
            left -= (size_t)sent;
        }
    }
    return 0;
}

/* A real interface's queue fills within an epoch (ENOBUFS): wait for the bus to carry some of it. One that
 * carries nothing for a second is as good as gone. */
static int send_datagrams(struct bus *bus, const struct can_frame *frames, int count)
{
    const struct timespec pause = {.tv_nsec = 500000};
    int pauses = 0;
    for (int i = 0; i < count;) {
        if (send(bus->descriptor, &frames[i], sizeof frames[i], 0) == (ssize_t)sizeof frames[i]) {
            i++;
            pauses = 0;
        } else if ((errno == ENOBUFS || errno == EAGAIN) && pauses++ < MOST_PAUSES) {
            (void)nanosleep(&pause, NULL);
        } else if (errno != EINTR) {
            return -1;
        }
    }
    return 0;
}

int bus_send(struct bus *bus, const struct can_frame *frames, int count)
{
    if (bus->is_stream)
        return send_stream(bus, (const char *)frames, (size_t)count * sizeof frames[0]);
    return send_datagrams(bus, frames, count);
}

void bus_close(struct bus *bus)
{
    if (bus->descriptor >= 0)
        close(bus->descriptor);
    bus->descriptor = -1;
}
