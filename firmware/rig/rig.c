/* An emulated ATmega328P with a machine around it, for `cargo xtask firmware`.
 *
 *     rig [options] IMAGE.elf
 *
 *     --link PATH       pseudo-terminal of the serial port, as a symbolic link
 *     --trace FILE      `s CYCLE T1 T2` for each step, `p CYCLE US` for each new width of a pen pulse,
 *                       `x CYCLE T1 T2` for the motors of a DC machine, each millisecond
 *     --dc G,TAU,S,F    DC motors: ticks/s per percent, s, stiction and friction in percent
 *     --start T1,T2     ticks of the motors at power-up
 *     --switch N,M,POS  switch N (1, 2, or 4 for stop) is closed while motor M is at or below POS
 *     --stop M,POS,CYCLE motor M (0, 1) cannot turn below POS. A stepper jumps back by CYCLE ticks, four full steps,
 *                       once its field leads by half of that
 *     --at S,EVENT      S seconds after the first motion: reset, power, hang, unplug1, unplug2,
 *                       close1, close2, close4, open1, open2, open4
 *     --garble-in N, --garble-out N   one byte in N is damaged, to and from the chip; N > 40
 *     --seed N          of these
 *     --pace X          X times real time at most (4)
 *     --hang ADDRESS    `hang` continues there (hexadecimal)
 *
 * It ends when standard input ends and nothing moves, and prints one line of JSON: times in cycles of
 * 1/16 us, interrupts by their vector. simavr adds no cycles for the response to an interrupt; a real
 * chip takes 4 to 7 more. The wire carries a byte in 1504 cycles: simavr's receiver takes 1496 for 11
 * bits where a real one takes 1389. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_time.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define CYCLES_PER_S 16000000.0
#define BYTE_CYCLES 1504
#define MS_CYCLES 16000

/* ATmega328P: addresses of registers in data space. */
enum { PORTB_AT = 0x25, PORTD_AT = 0x2b, TCCR1A_AT = 0x80, OCR1A_AT = 0x88, OCR1B_AT = 0x8a,
       TCCR2A_AT = 0xb0, OCR2A_AT = 0xb3, OCR2B_AT = 0xb4 };
#define TICK_VECTOR 8

static avr_t *avr;
static FILE *trace;
static uint64_t last_motion, first_motion;
static long at[2];

/* ---- random damage ---- */
static uint64_t random_state = 1;
static uint32_t garble_in, garble_out, garbled;

static uint32_t random32(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (uint32_t)(random_state >> 16);
}

/* The checksum of tick lines, an exclusive or, does not see two flips of the same bit: damaged bytes are
 * at least a line apart. `since` counts the bytes of one direction. */
#define APART 40
static uint8_t damage(uint8_t byte, uint32_t one_in, uint32_t *since) {
    if (one_in <= APART || ++*since < APART || random32() % (one_in - APART) != 0) {
        return byte;
    }
    *since = 0;
    garbled++;
    return byte ^ (uint8_t)(1u << random32() % 8);
}

static void moved(void) {
    last_motion = avr->cycle;
    if (!first_motion) {
        first_motion = avr->cycle;
    }
}

/* Drives an input pin from outside. simavr must be told twice: pull-ups that the program switches on
 * would otherwise win over the level until it changes. */
static uint8_t levels[26], masks[26];

static void drive_pin(char port, int bit, int level) {
    uint8_t *value = &levels[port - 'A'], *mask = &masks[port - 'A'];
    if (*mask & 1 << bit && !(*value & 1 << bit) == !level) {
        return;
    }
    avr_irq_t *pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit);
    /* simavr keeps the value of an irq through a reset of the chip, which clears its pins, and does not pass the
     * same value on again. */
    if (!(*mask & 1 << bit)) {
        avr_raise_irq(pin, !level);
    }
    *mask |= (uint8_t)(1 << bit);
    *value = (uint8_t)((*value & ~(1 << bit)) | (level ? 1 << bit : 0));
    avr_ioport_external_t external = {.name = (unsigned char)port, .mask = *mask, .value = *value};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
    avr_raise_irq(pin, level ? 1 : 0);
}

/* ---- mechanical stops ---- */
static struct { int used; long position, cycle, slip; } stops[2];
static double hardest[2]; /* largest duty against the stop, percent */

/* Where a stepper's rotor is, held back by a stop, when its field is at `field`: it stands as long as the field leads
 * by less than half a cycle, two full steps, and jumps to the stable place behind it then. */
static long rotor(int m, long field) {
    if (!stops[m].used) {
        return field;
    }
    while (stops[m].position - (field - stops[m].slip) > stops[m].cycle / 2) {
        stops[m].slip -= stops[m].cycle;
    }
    long free = field - stops[m].slip;
    return free < stops[m].position ? stops[m].position : free;
}

/* ---- switches ---- */
static struct { int used, motor; long position; } by_position[5];
static uint8_t forced;
static struct { char port; int bit; } switch_pin[5];

static void set_switches(void) {
    for (int n = 1; n <= 4; n *= 2) {
        int closed = forced & n || (by_position[n].used && at[by_position[n].motor] <= by_position[n].position);
        drive_pin(switch_pin[n].port, switch_pin[n].bit, !closed);
    }
}

/* ---- steppers ---- */
static uint64_t shortest_pulse = UINT64_MAX, rise[2], fastest = UINT64_MAX, shortest_setup = UINT64_MAX, direction_changed[2];
static long steps_made, field[2];

static void on_port_d(struct avr_irq_t *irq, uint32_t value, void *param) {
    static uint8_t before;
    (void)irq;
    (void)param;
    for (int m = 0; m < 2; m++) {
        uint8_t step = (uint8_t)(4 << m), direction = (uint8_t)(32 << m);
        if ((value ^ before) & direction) {
            direction_changed[m] = avr->cycle;
        }
        if (value & ~before & step) {
            if (rise[m] && avr->cycle - rise[m] < fastest) {
                fastest = avr->cycle - rise[m];
            }
            if (direction_changed[m] && avr->cycle - direction_changed[m] < shortest_setup) {
                shortest_setup = avr->cycle - direction_changed[m];
            }
            rise[m] = avr->cycle;
            field[m] += value & direction ? -1 : 1;
            at[m] = rotor(m, field[m]);
            steps_made++;
            moved();
            set_switches();
            if (trace) {
                fprintf(trace, "s %llu %ld %ld\n", (unsigned long long)avr->cycle, at[0], at[1]);
            }
        }
        if (before & ~value & step && rise[m] && avr->cycle - rise[m] < shortest_pulse) {
            shortest_pulse = avr->cycle - rise[m];
        }
    }
    before = (uint8_t)value;
}

/* ---- pen servo ---- */
static int pen_us;

/* simavr 1.6 makes matches of its own when a compare register is written, so output OC2A is modelled
 * here from the registers: in normal mode the pin is set or cleared when the counter equals OCR2A. */
static uint64_t servo_base, next_count;

static void servo_edge(int level) {
    static uint64_t risen;
    static int before;
    if (level && !before) {
        risen = avr->cycle;
    } else if (!level && before) {
        int us = (int)((avr->cycle - risen + 8) / 16);
        if (us < pen_us - 2 || us > pen_us + 2) {
            pen_us = us;
            if (trace) {
                fprintf(trace, "p %llu %d\n", (unsigned long long)avr->cycle, us);
            }
        }
    }
    before = level;
}

static void count_timer2(void) {
    uint8_t count = (uint8_t)((avr->cycle - servo_base) / 64), mode = avr->data[TCCR2A_AT] >> 6;
    next_count = servo_base + ((avr->cycle - servo_base) / 64 + 1) * 64;
    if (count == avr->data[OCR2A_AT] && mode >= 2) {
        servo_edge(mode == 3);
    }
}

/* ---- DC motors: tau dv/dt = g (u - f sign v) - v, at rest while |u| <= s (Karnopp) ---- */
static struct { int used; double g, tau, stiction, friction; } dc;
static double place[2], speed[2];
static long counts[2];
static int unplugged[2];
#define PLANT_S 2e-4
#define BAND 1.0

static void set_encoder(int m) {
    static const int gray[4] = {0, 1, 3, 2};
    if (!unplugged[m]) {
        int pins = gray[((counts[m] % 4) + 4) % 4];
        drive_pin('C', 2 * m, pins & 1);
        drive_pin('C', 2 * m + 1, pins >> 1);
    }
}

static double duty_of(int m) {
    if (!(avr->data[TCCR1A_AT] & (m ? 0x20 : 0x80))) {
        return 0; /* the pin is not driven by the timer */
    }
    int ocr = avr->data[(m ? OCR1B_AT : OCR1A_AT)] | avr->data[(m ? OCR1B_AT : OCR1A_AT) + 1] << 8;
    double duty = (ocr + 1) / 8.0;
    uint8_t port = avr->data[PORTD_AT];
    int forwards = port & (m ? 0x80 : 0x10), backwards = port & (m ? 0x40 : 0x20);
    return fmin(duty, 100) * ((forwards != 0) - (backwards != 0));
}

static void plant_step(int m) {
    double u = duty_of(m), v = speed[m], left = PLANT_S;
    if (fabs(v) < BAND) {
        v = 0;
        if (fabs(u) <= dc.stiction) {
            speed[m] = 0;
            return;
        }
    }
    double sign = v != 0 ? copysign(1, v) : copysign(1, u);
    double limit = dc.g * (u - dc.friction * sign);
    double stop = v != 0 && (v - limit) * sign > 0 && limit * sign < 0 ? dc.tau * log(1 - v / limit) : INFINITY;
    if (stop < left) { /* the speed passes through 0 within the step: on from rest */
        place[m] += limit * stop + v * dc.tau;
        left -= stop;
        v = 0;
        if (fabs(u) <= dc.stiction) {
            speed[m] = 0;
            return;
        }
        limit = dc.g * (u - dc.friction * copysign(1, u));
    }
    double decay = exp(-left / dc.tau);
    place[m] += limit * left + (v - limit) * dc.tau * (1 - decay);
    speed[m] = limit + (v - limit) * decay;
}

static avr_cycle_count_t plant(avr_t *chip, avr_cycle_count_t when, void *param) {
    static int substep;
    (void)param;
    for (int m = 0; m < 2; m++) {
        plant_step(m);
        if (stops[m].used && place[m] < (double)stops[m].position) {
            /* Rigid: the motor stands, whatever its duty. */
            hardest[m] = fmax(hardest[m], -duty_of(m));
            place[m] = (double)stops[m].position;
            speed[m] = fmax(speed[m], 0);
        }
        long count = (long)floor(place[m] + 0.5);
        while (counts[m] != count) {
            counts[m] += count > counts[m] ? 1 : -1;
            set_encoder(m);
            moved();
        }
        at[m] = counts[m];
    }
    set_switches();
    if (trace && substep++ % 5 == 0) {
        fprintf(trace, "x %llu %.3f %.3f\n", (unsigned long long)chip->cycle, place[0], place[1]);
    }
    return when + (avr_cycle_count_t)(PLANT_S * CYCLES_PER_S);
}

/* ---- serial port ---- */
static int master = -1;
static uint8_t pending[4096];
static size_t pending_from, pending_to;
static uint64_t bytes_in, bytes_out;

static void on_uart(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    (void)param;
    static uint32_t since;
    uint8_t byte = damage((uint8_t)value, garble_out, &since);
    bytes_out++;
    if (master >= 0 && write(master, &byte, 1) != 1) {
        /* nobody reads */
    }
}

static void open_port(const char *link) {
    master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (master < 0 || grantpt(master) || unlockpt(master)) {
        perror("pseudo-terminal");
        exit(2);
    }
    /* An open slave keeps the terminal alive between two senders. */
    int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    struct termios raw;
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    unlink(link);
    if (symlink(ptsname(master), link)) {
        perror(link);
        exit(2);
    }
}

static void feed(avr_irq_t *receiver) {
    static uint64_t next_byte, next_read;
    static uint32_t since;
    if (pending_from == pending_to && avr->cycle >= next_read) {
        next_read = avr->cycle + 1600;
        ssize_t got = read(master, pending, sizeof pending);
        pending_from = 0;
        pending_to = got > 0 ? (size_t)got : 0;
    }
    if (pending_from < pending_to && avr->cycle >= next_byte) {
        uint8_t byte = pending[pending_from++];
        avr_raise_irq(receiver, damage(byte, garble_in, &since));
        bytes_in++;
        next_byte = avr->cycle + BYTE_CYCLES;
    }
}

/* ---- interrupts ---- */
#define VECTORS 26
#define MCUSR_AT 0x54
static struct { uint64_t calls, cycles, longest; } vectors[VECTORS];
static struct { int vector; uint16_t sp; uint64_t start, nested; } stack[8];
static int depth, resets;
static uint64_t blocked_since, blocked_longest;
static uint16_t deepest = UINT16_MAX;

static uint16_t stack_pointer(void) {
    return (uint16_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
}

/* A reset forgets what drives the pins, and where timer 2 began. */
static void after_reset(void) {
    servo_base = 0;
    depth = 0;
    resets++;
    memset(masks, 0, sizeof masks);
    set_switches();
    if (dc.used) {
        set_encoder(0);
        set_encoder(1);
    }
}

static void before_instruction(void) {
    if (avr->pc == 0) {
        after_reset();
    }
    /* A vector's jump is executed only when its interrupt is served. */
    if (avr->pc > 0 && avr->pc < VECTORS * 4 && avr->pc % 4 == 0 && depth < 8) {
        if (avr->pc == TICK_VECTOR * 4 && !servo_base) {
            servo_base = avr->cycle - avr->data[OCR2B_AT] * 64; /* the counter equals OCR2B */
            next_count = avr->cycle + 64;
        }
        stack[depth].vector = (int)(avr->pc / 4);
        stack[depth].sp = stack_pointer();
        stack[depth].start = avr->cycle;
        stack[depth++].nested = 0;
    }
}

static void after_instruction(void) {
    if (servo_base && avr->cycle >= next_count) {
        count_timer2();
    }
    uint16_t sp = stack_pointer();
    if (sp < deepest && sp > 0x300) {
        deepest = sp;
    }
    while (depth > 0 && sp > stack[depth - 1].sp) {
        depth--;
        uint64_t all = avr->cycle - stack[depth].start, own = all - stack[depth].nested;
        int vector = stack[depth].vector;
        vectors[vector].calls++;
        vectors[vector].cycles += own;
        if (own > vectors[vector].longest) {
            vectors[vector].longest = own;
        }
        if (depth > 0) {
            stack[depth - 1].nested += all;
        }
    }
    if (avr->sreg[S_I]) {
        blocked_since = avr->cycle;
    } else if (first_motion && avr->cycle - blocked_since > blocked_longest) {
        blocked_longest = avr->cycle - blocked_since;
    }
}

/* ---- events ---- */
static struct { double s; char what[16]; } events[16];
static int event_count, events_done;
static uint32_t hang_at;

/* Power is lost for half a second: RAM holds anything afterwards, EEPROM what it held, and bytes that arrive
 * meanwhile are lost. */
static void lose_power(void) {
    avr_reset(avr);
    for (uint32_t at = 0x100; at <= avr->ramend; at++) {
        avr->data[at] = (uint8_t)(at * 167 + 13);
    }
    avr->data[MCUSR_AT] = 1; /* PORF */
    usleep(500000);
    uint8_t lost[256];
    while (read(master, lost, sizeof lost) > 0) {
    }
    pending_from = pending_to = 0;
}

static void do_event(const char *what) {
    fprintf(stderr, "rig: %s\n", what);
    if (!strcmp(what, "reset")) {
        avr_reset(avr);
    } else if (!strcmp(what, "power")) {
        lose_power();
    } else if (!strcmp(what, "hang")) {
        avr->pc = hang_at;
    } else if (!strncmp(what, "unplug", 6)) {
        unplugged[atoi(what + 6) - 1] = 1;
    } else if (!strncmp(what, "close", 5)) {
        forced |= (uint8_t)atoi(what + 5);
        set_switches();
    } else if (!strncmp(what, "open", 4)) {
        forced &= (uint8_t)~atoi(what + 4);
        set_switches();
    } else {
        fprintf(stderr, "rig: no event %s\n", what);
        exit(2);
    }
}

static double wall(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void print_summary(double took) {
    printf("{\"cycles\":%llu,\"first_motion\":%llu,\"steps\":%ld,\"at\":[%ld,%ld],\"pen_us\":%d,"
           "\"bytes_in\":%llu,\"bytes_out\":%llu,\"garbled\":%u,\"shortest_pulse\":%llu,\"fastest\":%llu,"
           "\"shortest_setup\":%llu,\"blocked_longest\":%llu,\"stack\":%d,\"speed\":%.2f,\"duty\":[%.1f,%.1f],\"hardest\":[%.1f,%.1f],\"vectors\":{",
           (unsigned long long)avr->cycle, (unsigned long long)first_motion, steps_made, at[0], at[1], pen_us,
           (unsigned long long)bytes_in, (unsigned long long)bytes_out, garbled,
           (unsigned long long)(shortest_pulse == UINT64_MAX ? 0 : shortest_pulse),
           (unsigned long long)(fastest == UINT64_MAX ? 0 : fastest),
           (unsigned long long)(shortest_setup == UINT64_MAX ? 0 : shortest_setup),
           (unsigned long long)blocked_longest, 0x8ff - deepest, (double)avr->cycle / CYCLES_PER_S / took, duty_of(0), duty_of(1), hardest[0], hardest[1]);
    int first = 1;
    for (int v = 0; v < VECTORS; v++) {
        if (vectors[v].calls) {
            printf("%s\"%d\":[%llu,%llu,%llu]", first ? "" : ",", v, (unsigned long long)vectors[v].calls,
                   (unsigned long long)vectors[v].cycles, (unsigned long long)vectors[v].longest);
            first = 0;
        }
    }
    printf("}}\n");
}

int main(int argc, char **argv) {
    const char *image = NULL, *link = NULL;
    double pace = 4;
    for (int i = 1; i < argc; i++) {
        const char *option = argv[i];
        if (option[0] != '-') {
            image = option;
            continue;
        }
        if (++i == argc) {
            fprintf(stderr, "rig: %s needs a value\n", option);
            return 2;
        }
        const char *value = argv[i];
        int n, m;
        long position, cycle;
        if (!strcmp(option, "--link")) {
            link = value;
        } else if (!strcmp(option, "--trace")) {
            trace = fopen(value, "w");
        } else if (!strcmp(option, "--dc") && sscanf(value, "%lf,%lf,%lf,%lf", &dc.g, &dc.tau, &dc.stiction, &dc.friction) == 4) {
            dc.used = 1;
        } else if (!strcmp(option, "--start") && sscanf(value, "%ld,%ld", &at[0], &at[1]) == 2) {
            counts[0] = at[0];
            counts[1] = at[1];
            field[0] = at[0];
            field[1] = at[1];
        } else if (!strcmp(option, "--switch") && sscanf(value, "%d,%d,%ld", &n, &m, &position) == 3) {
            by_position[n].used = 1;
            by_position[n].motor = m;
            by_position[n].position = position;
        } else if (!strcmp(option, "--stop") && sscanf(value, "%d,%ld,%ld", &m, &position, &cycle) == 3) {
            stops[m].used = 1;
            stops[m].position = position;
            stops[m].cycle = cycle;
        } else if (!strcmp(option, "--at") && event_count < 16
                   && sscanf(value, "%lf,%15s", &events[event_count].s, events[event_count].what) == 2) {
            event_count++;
        } else if (!strcmp(option, "--garble-in")) {
            garble_in = (uint32_t)atoi(value);
        } else if (!strcmp(option, "--garble-out")) {
            garble_out = (uint32_t)atoi(value);
        } else if (!strcmp(option, "--seed")) {
            random_state = strtoull(value, NULL, 10) * 0x9e3779b97f4a7c15u + 1;
        } else if (!strcmp(option, "--pace")) {
            pace = atof(value);
        } else if (!strcmp(option, "--hang")) {
            hang_at = (uint32_t)strtoul(value, NULL, 16);
        } else {
            fprintf(stderr, "rig: %s %s?\n", option, value);
            return 2;
        }
    }
    elf_firmware_t firmware = {0};
    if (!image || !link || elf_read_firmware(image, &firmware)) {
        fprintf(stderr, "usage: rig --link PATH [options] IMAGE.elf\n");
        return 2;
    }
    strcpy(firmware.mmcu, "atmega328p");
    firmware.frequency = 16000000;
    avr = avr_make_mcu_by_name(firmware.mmcu);
    avr_init(avr);
    avr_load_firmware(avr, &firmware);
    avr->log = 1;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_t *receiver = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_uart, NULL);
    if (dc.used) {
        switch_pin[1].port = 'D';
        switch_pin[1].bit = 2;
        switch_pin[2].port = 'D';
        switch_pin[2].bit = 3;
        for (int m = 0; m < 2; m++) {
            place[m] = (double)counts[m];
            set_encoder(m);
        }
        avr_cycle_timer_register(avr, (avr_cycle_count_t)(PLANT_S * CYCLES_PER_S), plant, NULL);
    } else {
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), IOPORT_IRQ_REG_PORT), on_port_d, NULL);
        switch_pin[1].port = 'B';
        switch_pin[1].bit = 1;
        switch_pin[2].port = 'B';
        switch_pin[2].bit = 2;
    }
    switch_pin[4].port = 'B';
    switch_pin[4].bit = 4;
    set_switches();
    open_port(link);

    double start = wall();
    uint64_t next_look = 0, next_ms = 0;
    int input_ended = 0, ready = 0;
    for (;;) {
        before_instruction();
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "rig: the chip stopped at %x\n", avr->pc);
            return 1;
        }
        after_instruction();
        if (avr->cycle < next_look) {
            continue;
        }
        next_look = avr->cycle + 160;
        feed(receiver);
        if (avr->cycle < next_ms) {
            continue;
        }
        next_ms = avr->cycle + MS_CYCLES;
        if (!ready && avr->cycle > 20 * MS_CYCLES) {
            ready = 1; /* the program listens */
            fprintf(stderr, "rig: ready\n");
        }
        double simulated = (double)avr->cycle / CYCLES_PER_S, ahead = simulated / pace - (wall() - start);
        if (ahead > 1e-3) {
            usleep((useconds_t)(ahead * 1e6));
        }
        while (events_done < event_count && first_motion
               && (double)(avr->cycle - first_motion) >= events[events_done].s * CYCLES_PER_S) {
            do_event(events[events_done++].what);
        }
        struct pollfd input = {.fd = 0, .events = POLLIN};
        if (!input_ended && poll(&input, 1, 0) > 0) {
            char ignored[64];
            input_ended = read(0, ignored, sizeof ignored) <= 0;
        }
        if (input_ended && avr->cycle - last_motion > 0.3 * CYCLES_PER_S) {
            break;
        }
    }
    print_summary(wall() - start);
    if (trace) {
        fclose(trace);
    }
    unlink(link);
    return 0;
}
