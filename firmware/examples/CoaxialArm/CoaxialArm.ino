/* The coaxial arm of docs/build-an-arm.md: two DC gearmotors with encoders, a pen servo.
   machine.h is the output of `plotplan machine show`, with the values to adjust in docs/firmware.md. */
#include <plotplan_firmware.h>
#include "machine.h"

void setup() {
  plotplan_setup(&plotplan_machine);
}

void loop() {
  plotplan_loop();
}
