#include "pen.h"

#include "machine.h"
#include "port.h"

static volatile bool down;
static int16_t z;

void pen_init(void) {
    down = false;
    z = machine->pen.up;
    pen_set(0);
}

void pen_set(uint8_t number) {
    down = number != 0;
    if (machine->pen.kind == PEN_SERVO) {
        port_servo((uint16_t)(down ? machine->pen.down : machine->pen.up));
    } else if (machine->pen.kind == PEN_SOLENOID) {
        port_solenoid(down);
    }
}

void pen_tick(void) {
    if (machine->pen.kind != PEN_Z) {
        return;
    }
    int16_t target = down ? machine->pen.down : machine->pen.up;
    if (z != target) {
        port_z_step(target > z);
        z += target > z ? 1 : -1;
    }
}
