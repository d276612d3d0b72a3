/* Start-up, serial port, clock, switches, pen servo and watchdog of the micro:bit. */
#if defined(PLOTPLAN_MICROBIT)

#include "port_microbit.h"

#include "machine.h"
#include "port_receive.h"

#define CLOCK 0x40000000u
#define UART 0x40002000u
#define TICK_TIMER 0x40009000u
#define WATCHDOG 0x40010000u
#define NVIC_ENABLE 0xe000e100u
#define NVIC_PRIORITY 0xe000e400u

#define IRQ_UART 2
#define IRQ_STEP 8
#define IRQ_TICK 9

#define PIN_TX 24
#define PIN_RX 25
#define SERVO_PERIOD_MS 20

static volatile uint16_t pulse_us;
static bool transmits;

/* ---- start-up ---- */
extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;
int main(void);
void timer0_interrupt(void);

void microbit_start(void);
void microbit_start(void) {
    const uint32_t *from = &data_load;
    for (uint32_t *to = &data_start; to < &data_end; to++) {
        *to = *from++;
    }
    for (uint32_t *to = &bss_start; to < &bss_end; to++) {
        *to = 0;
    }
    main();
}

/* A fault ends here, and the watchdog resets the chip. */
static void hang(void) {
    for (;;) {
    }
}

static void uart_interrupt(void);
static void timer1_interrupt(void);

__attribute__((section(".vectors"), used)) static void (*const vectors[16 + 10])(void) = {
    (void (*)(void))&stack_top, microbit_start, hang, hang, [11] = hang, [14] = hang, [15] = hang,
    [16 + IRQ_UART] = uart_interrupt,
    [16 + IRQ_STEP] = timer0_interrupt,
    [16 + IRQ_TICK] = timer1_interrupt,
};

static void enable_interrupt(uint8_t irq, uint8_t priority) {
    volatile uint32_t *group = &REGISTER(NVIC_PRIORITY + (irq & ~3u));
    *group = (*group & ~(0xffu << irq % 4 * 8)) | (uint32_t)priority << 6 << irq % 4 * 8;
    REGISTER(NVIC_ENABLE) = 1u << irq;
}

static void start_timer(uint32_t timer, uint32_t prescaler) {
    REGISTER(timer + 0x504) = 0; /* timer */
    REGISTER(timer + 0x508) = 0; /* 16 bits */
    REGISTER(timer + 0x510) = prescaler;
    REGISTER(timer + 0x00c) = 1;
    REGISTER(timer + 0x000) = 1;
}

void port_start_step_timer(void) {
    start_timer(STEP_TIMER, 3); /* 2 MHz */
    enable_interrupt(IRQ_STEP, 0);
}

void port_init(void) {
    /* Crystal: the RC oscillator is off by more than a serial port bears. */
    REGISTER(CLOCK + 0x000) = 1;
    while (!REGISTER(CLOCK + 0x100)) {
    }
    PIN_HIGH(PIN_TX);
    PIN_OUTPUT(PIN_TX);
    PIN_INPUT_PULLUP(PIN_RX);
    REGISTER(UART + 0x50c) = PIN_TX;
    REGISTER(UART + 0x514) = PIN_RX;
    REGISTER(UART + 0x524) = 0x01d7e000; /* 115200 baud */
    REGISTER(UART + 0x500) = 4;
    REGISTER(UART + 0x304) = 1u << 2; /* received */
    REGISTER(UART + 0x000) = 1;
    REGISTER(UART + 0x008) = 1;
    enable_interrupt(IRQ_UART, 1);
    PIN_OUTPUT(PIN_SERVO);
    PIN_INPUT_PULLUP(PIN_STOP);
    start_timer(TICK_TIMER, 4); /* 1 MHz */
    REGISTER(TICK_TIMER + 0x540) = 1000;
    REGISTER(TICK_TIMER + 0x304) = 1u << 16 | 1u << 17;
    enable_interrupt(IRQ_TICK, 2);
    REGISTER(WATCHDOG + 0x504) = 32768 / 4; /* 250 ms */
    REGISTER(WATCHDOG + 0x508) = 1;
    REGISTER(WATCHDOG + 0x000) = 1;
}

uint8_t port_lock(void) {
    uint32_t mask;
    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(mask)::"memory");
    return (uint8_t)mask;
}

void port_unlock(uint8_t state) {
    __asm__ volatile("msr primask, %0" ::"r"((uint32_t)state) : "memory");
}

static void uart_interrupt(void) {
    REGISTER(UART + 0x108) = 0;
    port_received((uint8_t)REGISTER(UART + 0x518));
}

bool port_send(uint8_t byte) {
    if (transmits && !REGISTER(UART + 0x11c)) {
        return false;
    }
    transmits = true;
    REGISTER(UART + 0x11c) = 0;
    REGISTER(UART + 0x51c) = byte;
    return true;
}

uint8_t port_switches(void) {
    uint8_t closed = PIN_IS_LOW(PIN_STOP) ? SWITCH_STOP : 0;
    closed |= PIN_IS_LOW(PIN_STEP_LIMIT1) ? SWITCH_1 : 0;
    closed |= PIN_IS_LOW(PIN_STEP_LIMIT2) ? SWITCH_2 : 0;
    return closed;
}

void port_servo(uint16_t us) {
    pulse_us = us;
}

void port_solenoid(bool on) {
    if (on) {
        PIN_HIGH(PIN_SERVO);
    } else {
        PIN_LOW(PIN_SERVO);
    }
}

void port_z_step(bool down) {
    (void)down;
}

/* Register 0 of the timer is the millisecond, register 1 the end of the servo's pulse. Steps and bytes
 * come first: a pulse may be longer by the time of their interrupts. */
static void timer1_interrupt(void) {
    static uint8_t phase;
    if (REGISTER(TICK_TIMER + 0x144)) {
        REGISTER(TICK_TIMER + 0x144) = 0;
        if (pulse_us) {
            PIN_LOW(PIN_SERVO);
        }
    }
    if (!REGISTER(TICK_TIMER + 0x140)) {
        return;
    }
    REGISTER(TICK_TIMER + 0x140) = 0;
    uint16_t now = (uint16_t)REGISTER(TICK_TIMER + 0x540);
    REGISTER(TICK_TIMER + 0x540) = (uint16_t)(now + 1000);
    if (++phase == SERVO_PERIOD_MS) {
        phase = 0;
        if (pulse_us) {
            PIN_HIGH(PIN_SERVO);
            REGISTER(TICK_TIMER + 0x048) = 1;
            REGISTER(TICK_TIMER + 0x544) = (uint16_t)(REGISTER(TICK_TIMER + 0x548) + pulse_us);
        }
    }
    machine_tick();
}

void port_feed_watchdog(void) {
    REGISTER(WATCHDOG + 0x600) = 0x6e524635;
}

flash_text port_reset_cause(void) {
    uint32_t cause = REGISTER(0x40000400u);
    return cause & 2 ? TEXT("watchdog") : cause & 1 ? TEXT("reset") : TEXT("power");
}

#endif
