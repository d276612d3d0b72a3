/* The reader of docs/tick-lines.md on this computer, at the other end of a pseudo-terminal.
   Usage: host MOVES [EVERY]. Prints the name of its port; writes each move as PEN,T1,T2,DURATION to the file
   MOVES; ends after the end of the plan. Every EVERY-th line is lost. */
#define _XOPEN_SOURCE 600
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include "reader.c"

static FILE *moves_file;
static int port;
static int32_t position[2];
static unsigned pen_now;
static int is_homed;

void pen(uint16_t number) { pen_now = number; }

void move_to(int32_t t1, int32_t t2, uint32_t microseconds) {
    position[0] = t1;
    position[1] = t2;
    fprintf(moves_file, "%u,%ld,%ld,%lu\n", pen_now, (long)t1, (long)t2, (unsigned long)microseconds);
}

int position_is(int32_t t1, int32_t t2) {
    if (!is_homed) {
        is_homed = 1;
        position[0] = t1;
        position[1] = t2;
    }
    return position[0] == t1 && position[1] == t2;
}

int where(int32_t *t1, int32_t *t2) {
    *t1 = position[0];
    *t2 = position[1];
    return is_homed ? 0 : -1;
}

void answer(const char *text) {
    size_t length = strlen(text);
    if (write(port, text, length) != (ssize_t)length) exit(4);
}

int main(int count, char **arguments) {
    static char line[96];
    unsigned length = 0, lines = 0;
    unsigned every = count > 2 ? (unsigned)atoi(arguments[2]) : 0;
    int timeout_ms = 20000;
    if (count < 2 || !(moves_file = fopen(arguments[1], "w"))) return 2;
    port = posix_openpt(O_RDWR | O_NOCTTY);
    if (port < 0 || grantpt(port) || unlockpt(port)) return 3;
    int other = open(ptsname(port), O_RDWR | O_NOCTTY);
    struct termios raw;
    if (other < 0 || tcgetattr(other, &raw)) return 3;
    raw.c_iflag = raw.c_oflag = raw.c_lflag = 0;
    tcsetattr(other, TCSANOW, &raw);
    printf("%s\n", ptsname(port));
    fflush(stdout);
    for (;;) {
        struct pollfd waiting = {port, POLLIN, 0};
        if (poll(&waiting, 1, timeout_ms) <= 0) break;
        char byte;
        if (read(port, &byte, 1) != 1) break;
        if (byte != '\n') {
            if (length < sizeof line - 1) line[length++] = byte;
            continue;
        }
        line[length] = '\0';
        length = 0;
        lines++;
        if (every && lines % every == 0) continue;
        /* After the end only repeats are answered, for half a second. */
        if (received(line) == 1) timeout_ms = 500;
    }
    fclose(moves_file);
    return timeout_ms == 500 ? 0 : 1;
}
