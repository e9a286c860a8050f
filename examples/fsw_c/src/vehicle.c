/* A strict reader of the TOML subset that vehicle files use: `key = value` lines, values are strings, numbers
 * or one-line arrays of three numbers or of strings, and `[[antenna]]` opens the next antenna. The table
 * `[receivers]` before the first is passed over. Everything else is refused with its line number. */
#include "vehicle.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vec.h"

#define RADIANS_PER_DEGREE 0.017453292519943295

enum field { NAME, RECEIVER, CHANNELS, CLOCK_DOMAIN, BORESIGHT, LEVER_ARM, MASK, OTHERS, FIELDS };

static const char *const key_of[FIELDS] = {
    "name", "receiver", "channels", "clock_domain", "boresight_body", "lever_arm_body_m", "mask_deg",
    "other_signals",
};

struct draft { /* an antenna as its table is read */
    unsigned given; /* bit f: field f was given */
    double receiver, channels, clock_domain, mask_deg;
    double boresight_body[3], lever_arm_body_m[3];
};

static char *trim(char *text)
{
    while (isspace((unsigned char)*text))
        text++;
    char *end = text + strlen(text);
    while (end > text && isspace((unsigned char)end[-1]))
        end--;
    *end = '\0';
    return text;
}

/* Cuts a comment off; a '#' inside quotes belongs to the string. */
static void cut_comment(char *line)
{
    bool quoted = false;
    for (; *line; line++) {
        if (*line == '"')
            quoted = !quoted;
        if (*line == '#' && !quoted) {
            *line = '\0';
            return;
        }
    }
}

/* One finite number, and where it ends; NULL where there is none. */
static char *number(char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && isfinite(*value) ? end : NULL;
}

static bool is_string(const char *text)
{
    size_t length = strlen(text);
    return length >= 3 && text[0] == '"' && strchr(text + 1, '"') == text + length - 1;
}

static bool one_number(char *text, double *value)
{
    char *end = number(text, value);
    return end && *trim(end) == '\0';
}

static bool whole(double value, double lowest, double highest)
{
    return value == floor(value) && lowest <= value && value <= highest;
}

static bool whole_number(char *text, double lowest, double highest, double *value)
{
    return one_number(text, value) && whole(*value, lowest, highest);
}

static bool three_numbers(char *text, double value[3])
{
    if (*text++ != '[')
        return false;
    for (int i = 0; i < 3; i++) {
        text = number(trim(text), &value[i]);
        if (!text)
            return false;
        text = trim(text);
        if (*text++ != (i < 2 ? ',' : ']'))
            return false;
    }
    return *trim(text) == '\0';
}

/* Whether it is an array of strings, perhaps empty. */
static bool strings(char *text)
{
    if (*text++ != '[')
        return false;
    for (text = trim(text); *text == '"'; text = trim(text)) {
        char *end = strchr(text + 1, '"');
        if (!end || end == text + 1)
            return false;
        text = trim(end + 1);
        if (*text != ',')
            break;
        text++;
    }
    return *text == ']' && *trim(text + 1) == '\0';
}

/* Takes a value into the draft; NULL, or what is allowed. */
static const char *take(struct draft *draft, enum field field, char *text)
{
    switch (field) {
    case NAME:
        return is_string(text) ? NULL : "a name in quotes";
    case RECEIVER:
        return whole_number(text, 1, MAX_RECEIVERS, &draft->receiver) ? NULL : "a whole number, 1 to 8";
    case CHANNELS:
        return whole_number(text, 1, MAX_CHANNELS, &draft->channels) ? NULL : "a whole number, 1 to 32";
    case CLOCK_DOMAIN:
        return whole_number(text, 0, MAX_DOMAINS - 1, &draft->clock_domain) ? NULL : "a whole number, 0 to 7";
    case BORESIGHT:
        return three_numbers(text, draft->boresight_body) && fabs(norm(draft->boresight_body) - 1.0) <= 1e-3
                   ? NULL : "three numbers of length 1";
    case LEVER_ARM:
        return three_numbers(text, draft->lever_arm_body_m) ? NULL : "three numbers";
    case MASK:
        return one_number(text, &draft->mask_deg) && draft->mask_deg > 0 && draft->mask_deg <= 180
                   ? NULL : "an angle above 0, up to 180";
    case OTHERS: /* of a receiver of several carriers; this program tracks each satellite by its first */
        return strings(text) ? NULL : "names of signals in brackets";
    default:
        return "a known key";
    }
}

/* Takes a `key = value` line; NULL, or what is wrong, for which `why` may hold the words. */
static const char *take_line(struct draft *draft, bool in_antenna, char *line, char *why, size_t size)
{
    char *equals = strchr(line, '=');
    if (!equals)
        return "not a line of a vehicle file";
    *equals = '\0';
    const char *key = trim(line);
    char *value = trim(equals + 1);
    for (int f = 0; f < (in_antenna ? FIELDS : NAME + 1); f++) {
        if (strcmp(key, key_of[f]) != 0)
            continue;
        if (draft->given & 1U << f)
            return "this key was given before";
        draft->given |= 1U << f;
        const char *allowed = take(draft, (enum field)f, value);
        if (allowed)
            snprintf(why, size, "%s: found %.40s, allowed is %s", key, value, allowed);
        return allowed ? why : NULL;
    }
    snprintf(why, size, "%.40s: unknown key", key);
    return why;
}

/* A read antenna becomes its receiver's row; NULL, or what is wrong. */
static const char *settle(struct vehicle *vehicle, const struct draft *draft, unsigned *receivers)
{
    if ((draft->given | 1U << CLOCK_DOMAIN | 1U << OTHERS) != (1U << FIELDS) - 1)
        return "an antenna needs name, receiver, channels, boresight_body, lever_arm_body_m and mask_deg";
    int row = (int)draft->receiver - 1;
    if (*receivers & 1U << row)
        return "two antennas have the same receiver";
    *receivers |= 1U << row;
    struct antenna *antenna = &vehicle->antenna[row];
    antenna->channels = (int)draft->channels;
    antenna->clock_domain = (int)draft->clock_domain;
    antenna->mask_rad = draft->mask_deg * RADIANS_PER_DEGREE;
    double length = norm(draft->boresight_body);
    for (int i = 0; i < 3; i++) {
        antenna->boresight_body[i] = draft->boresight_body[i] / length;
        antenna->lever_arm_body_m[i] = draft->lever_arm_body_m[i];
    }
    vehicle->antennas++;
    return NULL;
}

static const char *read_lines(FILE *file, struct vehicle *vehicle, int *line_number, char *why, size_t size)
{
    char line[512];
    struct draft draft = {0};
    unsigned receivers = 0;
    bool in_antenna = false, in_figures = false;

    while (fgets(line, sizeof line, file)) {
        const char *fault = NULL;
        ++*line_number;
        if (!strchr(line, '\n') && !feof(file))
            return "longer than 510 characters";
        cut_comment(line);
        char *text = trim(line);
        if (*text == '\0')
            continue;
        if (strcmp(text, "[receivers]") == 0 && !in_antenna) {
            in_figures = true; /* what receivers are known to err by: this software weighs by its own */
            continue;
        }
        if (strcmp(text, "[[antenna]]") == 0) {
            in_figures = false;
            if (in_antenna)
                fault = settle(vehicle, &draft, &receivers);
            memset(&draft, 0, sizeof draft);
            in_antenna = true;
        } else if (!in_figures) {
            fault = take_line(&draft, in_antenna, text, why, size);
        }
        if (fault)
            return fault;
    }
    if (ferror(file))
        return strerror(errno);
    if (!in_antenna)
        return "no [[antenna]]";
    const char *fault = settle(vehicle, &draft, &receivers);
    if (!fault && receivers != (1U << vehicle->antennas) - 1)
        fault = "receivers must count up from 1 without a gap";
    return fault;
}

int vehicle_read(const char *path, struct vehicle *vehicle, char *why, size_t size)
{
    char words[160];
    int line_number = 0;
    memset(vehicle, 0, sizeof *vehicle);
    FILE *file = fopen(path, "r");
    if (!file) {
        snprintf(why, size, "vehicle file %s: %s", path, strerror(errno));
        return -1;
    }
    const char *fault = read_lines(file, vehicle, &line_number, words, sizeof words);
    fclose(file);
    if (!fault && vehicle->antennas != CONTRACT_RECEIVERS) {
        snprintf(words, sizeof words, "%d antennas; this program was built for %d (make RECEIVERS=%d)",
                 vehicle->antennas, CONTRACT_RECEIVERS, vehicle->antennas);
        fault = words;
    }
    if (fault)
        snprintf(why, size, "%s, line %d: %s", path, line_number, fault);
    return fault ? -1 : 0;
}
