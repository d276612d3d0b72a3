/* The main loop: bytes in, answers out, drives. */
#include "plotplan_firmware.h"

#include "machine.h"
#include "port.h"
#include "tick_lines.h"

static char answer[ANSWER_BYTES];
static uint8_t answer_at, answer_length;
static uint16_t fed_ms;

void plotplan_setup(const struct plotplan_machine *configuration) {
    uint8_t state = port_lock();
    port_init();
    machine_init(configuration);
    tick_lines_init(configuration->name, PLOTPLAN_RECEIVE - 1);
    port_unlock(state);
}

static void receive(void) {
    while (!tick_lines_owes_answer()) {
        int16_t byte = port_peek();
        if (byte < 0 || !tick_lines_byte((uint8_t)byte)) {
            return;
        }
        port_drop();
    }
}

static void send(void) {
    if (answer_at < answer_length) {
        if (port_send((uint8_t)answer[answer_at])) {
            answer_at++;
        }
    } else if (tick_lines_owes_answer()) {
        answer_length = tick_lines_answer(answer);
        answer_at = 0;
    }
}

void plotplan_loop(void) {
    receive();
    send();
    machine_poll();
    /* Fed only while the millisecond interrupt is alive as well. */
    uint16_t now = machine_ms();
    if (now != fed_ms) {
        fed_ms = now;
        port_feed_watchdog();
    }
}
