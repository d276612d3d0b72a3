/* Step and direction pins of two drivers: one timer interrupt at each step, of either motor. */
#if defined(__AVR__) || defined(PLOTPLAN_MICROBIT)

#include <stddef.h>

#include "drive.h"
#include "machine.h"
#include "pen.h"
#include "port_pins.h"
#include "step_clock.h"

/* The interrupt's speed sets the largest step rate; the 300 bytes more are well spent. */
#pragma GCC optimize("O2")

/* Prepared pieces, a power of 2. */
#define PIECES 8
/* Motion starts when the queue is full, or this long after its last line. */
#define START_DELAY_MS 200
/* From the decision to start to the first event, half us. */
#define START_LEAD 400
/* If fewer counts than this are left after a compare register was written, the match may be missed. */
#define MATCH_MARGIN 8

static struct piece pieces[PIECES];
static volatile uint8_t head, tail;
static volatile bool running;
/* Set if pieces ran out although the last one moved. */
static volatile bool ran_dry;
static volatile uint8_t pen_wanted;
static uint8_t pen_set_to;
/* Where the motors will be once all prepared pieces are executed. What is left of them is subtracted when the
 * position is asked for, which costs the interrupt nothing. */
static int32_t end1, end2;
static struct cutter cutter;
/* `poll` drops what it prepared if this changed meanwhile. */
static volatile uint8_t halts;
static uint16_t line_ms;

/* The interrupt's own. */
static struct step_clock clock1, clock2;
static uint16_t event, piece_end;
static uint8_t backwards, reversed;
static bool piece_moves;

static void init(void) {
    PIN_OUTPUT(PIN_STEP1);
    PIN_OUTPUT(PIN_STEP2);
    PIN_OUTPUT(PIN_DIR1);
    PIN_OUTPUT(PIN_DIR2);
    PIN_OUTPUT(PIN_Z_STEP);
    PIN_OUTPUT(PIN_Z_DIR);
    PIN_OUTPUT(PIN_ENABLE);
    PIN_LOW(PIN_ENABLE);
    PIN_INPUT_PULLUP(PIN_STEP_LIMIT1);
    PIN_INPUT_PULLUP(PIN_STEP_LIMIT2);
    reversed = (machine->motor[0].reversed ? 1 : 0) | (machine->motor[1].reversed ? 2 : 0);
    STEP_START();
}

/* Loads the next piece, which begins at `now`; there is one. */
static inline void load_piece(uint16_t now) {
    const struct piece *piece = &pieces[tail];
    step_clock_load(&clock1, &piece->motor[0], now);
    step_clock_load(&clock2, &piece->motor[1], now);
    piece_end = now + piece->duration;
    piece_moves = clock1.left || clock2.left;
    backwards = piece->backwards;
    pen_wanted = piece->pen;
    uint8_t pins = backwards ^ reversed;
    if (pins & 1) {
        PIN_HIGH(PIN_DIR1);
    } else {
        PIN_LOW(PIN_DIR1);
    }
    if (pins & 2) {
        PIN_HIGH(PIN_DIR2);
    } else {
        PIN_LOW(PIN_DIR2);
    }
    tail = (tail + 1) & (PIECES - 1);
}

static inline uint16_t time_to_next_event(uint16_t now) {
    return step_clock_wait(&clock2, now, step_clock_wait(&clock1, now, piece_end - now));
}

STEP_INTERRUPT {
    uint16_t now = event;
    STEP_ACKNOWLEDGE();
    /* The flag rises one count after the match, so a cleared flag may rise again. */
    if ((int16_t)(STEP_COUNT() - now) < 0) {
        return;
    }
    for (;;) {
        bool due1 = step_clock_is_due(&clock1, now), due2 = step_clock_is_due(&clock2, now);
        if (due1) {
            PIN_HIGH(PIN_STEP1);
        }
        if (due2) {
            PIN_HIGH(PIN_STEP2);
        }
        if (due1) {
            step_clock_advance(&clock1);
        }
        if (due2) {
            step_clock_advance(&clock2);
        }
        if (!clock1.left && !clock2.left) {
            if (tail != head) {
                /* Not at the piece's end, where the first steps of the next one may be due: after the last step,
                 * which is half an interval before the end of its line. */
                load_piece(piece_end);
            } else if (now == piece_end) {
                running = false;
                ran_dry = piece_moves;
                STEP_DISABLE();
                break;
            }
        }
        uint16_t wait = time_to_next_event(now);
        uint16_t next = now + wait;
        STEP_MATCH(next);
        event = next;
        if ((uint16_t)(STEP_COUNT() - now) + MATCH_MARGIN < wait) {
            break;
        }
        PIN_LOW(PIN_STEP1);
        PIN_LOW(PIN_STEP2);
        while ((uint16_t)(STEP_COUNT() - now) < wait) {
        }
        now = next;
        STEP_CLEAR();
    }
    PIN_LOW(PIN_STEP1);
    PIN_LOW(PIN_STEP2);
}

static void set_position(int32_t ticks1, int32_t ticks2) {
    uint8_t state = port_lock();
    end1 = ticks1;
    end2 = ticks2;
    clock1.left = clock2.left = 0;
    port_unlock(state);
}

static int32_t towards(uint8_t is_backwards, uint16_t steps) {
    return is_backwards ? -(int32_t)steps : (int32_t)steps;
}

/* Steps wait while interrupts are off, so only what the step interrupt changes is read then. Pieces stay as they
 * are: the main loop prepares them, and this is called by it or interrupts it. */
static void position(int32_t ticks[2]) {
    uint8_t state = port_lock();
    uint8_t first = tail, way = backwards;
    uint16_t left1 = clock1.left, left2 = clock2.left;
    port_unlock(state);
    ticks[0] = end1 - towards(way & 1, left1);
    ticks[1] = end2 - towards(way & 2, left2);
    for (uint8_t i = first; i != head; i = (i + 1) & (PIECES - 1)) {
        ticks[0] -= towards(pieces[i].backwards & 1, pieces[i].motor[0].steps);
        ticks[1] -= towards(pieces[i].backwards & 2, pieces[i].motor[1].steps);
    }
}

static bool is_moving(void) {
    return running || head != tail || !cutter_is_done(&cutter);
}

/* Prepares one piece; false if there is nothing to prepare or no room. */
static bool prepare(void) {
    uint8_t next = (head + 1) & (PIECES - 1), seen = halts;
    if (next == tail) {
        return false;
    }
    if (cutter_is_done(&cutter)) {
        struct segment segment;
        if (!queue_pop(&segment)) {
            return false;
        }
        cutter_start(&cutter, &segment);
        line_ms = machine_ms();
    }
    struct piece *piece = &pieces[head];
    cutter_cut(&cutter, piece);
    uint8_t state = port_lock();
    if (seen == halts) {
        end1 += towards(piece->backwards & 1, piece->motor[0].steps);
        end2 += towards(piece->backwards & 2, piece->motor[1].steps);
        head = next;
    } else {
        cutter.left = 0;
    }
    port_unlock(state);
    return true;
}

static void start(void) {
    uint8_t state = port_lock();
    if (head != tail) {
        event = STEP_COUNT() + START_LEAD;
        load_piece(event);
        running = true;
        event += time_to_next_event(event);
        STEP_MATCH(event);
        STEP_CLEAR();
        STEP_ENABLE();
    }
    port_unlock(state);
}

static void poll(void) {
    if (ran_dry) {
        ran_dry = false;
        machine_count_late();
    }
    while (prepare()) {
        if (running) {
            break;
        }
    }
    if (!running && head != tail
        && (queue_is_full() || (uint16_t)(machine_ms() - line_ms) > START_DELAY_MS)) {
        start();
    }
}

/* The pen belongs to the start of a piece; a millisecond does not matter to it. */
static void tick(void) {
    uint8_t wanted = pen_wanted;
    if (wanted != pen_set_to) {
        pen_set_to = wanted;
        pen_set(wanted);
    }
}

static void halt(void) {
    uint8_t state = port_lock();
    STEP_DISABLE();
    int32_t here[2];
    position(here);
    set_position(here[0], here[1]);
    running = false;
    head = tail = 0;
    cutter.left = 0;
    piece_moves = false;
    pen_wanted = 0;
    halts++;
    port_unlock(state);
}

const struct drive step_drive = {
    .name = "step",
    .init = init,
    .set_position = set_position,
    .position = position,
    .is_moving = is_moving,
    .poll = poll,
    .tick = tick,
    .halt = halt,
    .measure = NULL,
    .measures_position = false,
};

#endif
