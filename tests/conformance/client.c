/* A node on the embedded bus in C: answers every frame it reads with the same payload under the next
 * identifier, until the bus ends. Prints how many it answered. */
#include <linux/can.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static int read_frame(int bus, struct can_frame *frame)
{
    size_t have = 0;
    while (have < sizeof *frame) {
        ssize_t n = read(bus, (char *)frame + have, sizeof *frame - have);
        if (n <= 0)
            return 0;
        have += (size_t)n;
    }
    return 1;
}

int main(int argc, char **argv)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    struct can_frame frame;
    int answered = 0;
    int bus = socket(AF_UNIX, SOCK_STREAM, 0);

    if (argc != 2 || strlen(argv[1]) >= sizeof address.sun_path)
        return 2;
    strcpy(address.sun_path, argv[1]);
    if (connect(bus, (struct sockaddr *)&address, sizeof address))
        return 3;
    printf("ready\n");
    fflush(stdout);
    while (read_frame(bus, &frame)) {
        frame.can_id++;
        if (write(bus, &frame, sizeof frame) != sizeof frame)
            break;
        answered++;
    }
    printf("%d\n", answered);
    return 0;
}
