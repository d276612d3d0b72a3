/* Machine header of the plotplan firmware: plotplan machine show coaxial --firmware-config dc
   Wiring and the values to adjust: docs/firmware.md */
#include "plotplan_firmware.h"

#if PLOTPLAN_CONFIG_VERSION != 2
#error "this header was written for another version of the firmware"
#endif

static const struct plotplan_machine plotplan_machine = {
    /* .name */ "coaxial", /* a plan for another machine is refused */
    /* .drive */ &dc_drive,
    { /* .motor */
        { /* arm1: 509.296 ticks per rad or mm, at most 533.3 ticks/s */
            /* .shortest_tick_us */ 1838, /* .reversed, .encoder_reversed */ false, false,
            /* .lowest, .highest */ -313, 2865,
            /* .loop */ {3072, 262, 3840, 1440, 48, 40}, /* .servo */ {1500, 256},
        },
        { /* arm2: 509.296 ticks per rad or mm, at most 533.3 ticks/s */
            /* .shortest_tick_us */ 1838, /* .reversed, .encoder_reversed */ false, false,
            /* .lowest, .highest */ -1071, 2142,
            /* .loop */ {3072, 262, 3840, 1440, 48, 40}, /* .servo */ {1500, 256},
        },
    },
    /* .pen: kind, up, down (us) */ {PEN_SERVO, 1000, 1500},
    /* .homing */ {{false, 0, {0, 0}, 0, 0, 0, 0, 0}, {false, 0, {0, 0}, 0, 0, 0, 0, 0}},
    /* .home */ {0, 0}, /* .must_home */ false,
    /* .limits_used, .stop_used */ false, false,
};
