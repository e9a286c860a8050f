/* The process: its arguments, the bus, the clock, signals. */
#include <errno.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bus.h"
#include "flight.h"

enum { HEARTBEAT_MS = 100, BUS_WAIT_MS = 60000, BUS_RETRY_MS = 100 };
enum { EXIT_FAILED = 1, EXIT_USAGE = 2, EXIT_ENVIRONMENT = 3, EXIT_INTERRUPTED = 130 };

static const char usage[] =
    "usage: fsw [--bus BUS] [--vehicle FILE] [--tell] [--stay]\n"
    "\n"
    "A flight software for gnss-hil's bus, in C.\n"
    "\n"
    "  --bus BUS       embedded:PATH or socketcan:INTERFACE (default: $GNSS_HIL_BUS)\n"
    "                  one that nobody serves yet is waited for, a minute\n"
    "  --vehicle FILE  antennas of the craft, TOML (default: $GNSS_HIL_VEHICLE)\n"
    "  --tell          say at the end what was flown, though nothing was refused or lost\n"
    "  --stay          wait for the next run at a run's end, instead of leaving\n"
    "\n"
    "examples:\n"
    "  gnss-hil run soyuz --flight build/fsw\n"
    "  build/fsw --bus socketcan:vcan0 --vehicle ../../dbc/vehicles/soyuz-ms.toml\n"
    "\n"
    "Exit status: 0 done; 1 the bus went away during a run; 2 bad usage or vehicle file; 3 no such bus;\n"
    "130 interrupted.\n";

struct options {
    const char *bus, *vehicle;
    bool tell, stay;
};

/* Signals may only set a flag; it is the one variable outside the state. */
static volatile sig_atomic_t interrupted;

static void on_signal(int number)
{
    (void)number;
    interrupted = 1;
}

static void catch_signals(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal; /* no SA_RESTART: waiting ends at once */
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

static int64_t clock_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static int fail(int status, const char *words)
{
    fprintf(stderr, "fsw: %s\n", words);
    return status;
}

/* 0, or an exit status; *leave: there is nothing more to do. */
static int read_options(int argc, char **argv, struct options *options, bool *leave)
{
    char words[160];
    *leave = false;
    *options = (struct options){getenv("GNSS_HIL_BUS"), getenv("GNSS_HIL_VEHICLE"), false, false};
    for (int i = 1; i < argc; i++) {
        bool takes_value = strcmp(argv[i], "--bus") == 0 || strcmp(argv[i], "--vehicle") == 0;
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            *leave = true;
            return 0;
        }
        if (takes_value && i + 1 < argc) {
            *(strcmp(argv[i], "--bus") == 0 ? &options->bus : &options->vehicle) = argv[i + 1];
            i++;
        } else if (strcmp(argv[i], "--tell") == 0) {
            options->tell = true;
        } else if (strcmp(argv[i], "--stay") == 0) {
            options->stay = true;
        } else {
            snprintf(words, sizeof words, takes_value ? "%.80s needs a value (see --help)"
                                                      : "unknown argument '%.80s' (see --help)", argv[i]);
            return fail(EXIT_USAGE, words);
        }
    }
    if (!options->bus)
        return fail(EXIT_USAGE, "no bus: give --bus or set GNSS_HIL_BUS");
    if (!options->vehicle)
        return fail(EXIT_USAGE, "no vehicle file: give --vehicle or set GNSS_HIL_VEHICLE");
    return 0;
}

/* Opens the bus, waiting for one that nobody serves yet; as bus_open. */
static int await_bus(struct bus *bus, const char *spec, char *why, size_t size)
{
    const struct timespec pause = {.tv_nsec = BUS_RETRY_MS * 1000000L};
    const int64_t until_ms = clock_ms() + BUS_WAIT_MS;
    bool told = false;
    int found;
    while ((found = bus_open(bus, spec, why, size)) == BUS_NOT_YET && !interrupted && clock_ms() < until_ms) {
        if (!told)
            fprintf(stderr, "fsw: waiting for a bus at %s\n", spec);
        told = true;
        (void)nanosleep(&pause, NULL);
    }
    return found;
}

/* Plays all frames of a batch; -1 when the bus is gone. */
static int play(struct bus *bus, struct flight *flight, const struct can_frame *frames, int count, int64_t now_ms)
{
    for (int i = 0; i < count;) {
        bool again;
        if (flight_hear(flight, &frames[i], now_ms, &again) &&
            bus_send(bus, flight->outbox.block.frame, flight->outbox.block.count) != 0)
            return -1;
        if (!again)
            i++;
    }
    return 0;
}

static int patience_ms(const struct flight *flight, int64_t now_ms)
{
    int64_t due_ms = slave_due_ms(&flight->slave);
    if (due_ms < 0 || due_ms - now_ms > HEARTBEAT_MS)
        return HEARTBEAT_MS;
    return due_ms > now_ms ? (int)(due_ms - now_ms) : 0;
}

/* Until the run's end; -1 when the bus is gone. */
static int fly(struct bus *bus, struct flight *flight, bool stay)
{
    static struct can_frame frames[BUS_BATCH];
    const struct can_frame greeting = flight_greeting();
    int64_t greeted_ms = 0;
    while (!interrupted && (stay || !flight->ended)) {
        int64_t now_ms = clock_ms();
        if (flight_is_waiting(flight, now_ms) && now_ms - greeted_ms >= HEARTBEAT_MS) {
            if (bus_send(bus, &greeting, 1) != 0)
                return -1;
            greeted_ms = now_ms;
        }
        int count = bus_receive(bus, frames, patience_ms(flight, now_ms));
        now_ms = clock_ms();
        if (count < 0 || play(bus, flight, frames, count, now_ms) != 0)
            return -1;
        if (flight_wait(flight, now_ms) && bus_send(bus, flight->outbox.block.frame, flight->outbox.block.count) != 0)
            return -1;
    }
    return 0;
}

/* What a run's end must not hide. */
static void tell(const struct flight *flight, bool anyway)
{
    unsigned long refused = 0;
    for (int reason = 0; reason < REASONS; reason++)
        refused += flight->inbox.refused[reason];
    if (!anyway && refused + flight->inbox.frames_lost + flight->slave.lost + flight->slave.refused == 0)
        return;
    fprintf(stderr, "fsw: %lu epochs, %lu fixes; %lu frames lost", flight->epochs, flight->fixes,
            flight->inbox.frames_lost > flight->slave.lost ? flight->inbox.frames_lost : flight->slave.lost);
    for (int reason = 0; reason < REASONS; reason++)
        if (flight->inbox.refused[reason])
            fprintf(stderr, ", %lu refused: %s", flight->inbox.refused[reason], reason_names[reason]);
    if (flight->slave.refused)
        fprintf(stderr, ", %lu bench frames or time marks refused", flight->slave.refused);
    fputc('\n', stderr);
}

int main(int argc, char **argv)
{
    static struct flight flight; /* all state there is: too large for a stack, never moved */
    static struct bus bus;
    struct options options;
    char why[320];
    bool leave;

    int status = read_options(argc, argv, &options, &leave);
    if (status || leave)
        return status;
    if (vehicle_read(options.vehicle, &flight.vehicle, why, sizeof why) != 0)
        return fail(EXIT_USAGE, why);
    catch_signals();
    if (await_bus(&bus, options.bus, why, sizeof why) != 0)
        return interrupted ? EXIT_INTERRUPTED : fail(EXIT_ENVIRONMENT, why);
    int gone = fly(&bus, &flight, options.stay);
    bus_close(&bus);
    tell(&flight, options.tell);
    if (interrupted)
        return EXIT_INTERRUPTED;
    return gone && flight.slave.running ? EXIT_FAILED : 0;
}
