/* An x-y table with two steppers on a CNC shield and a pen servo on D11.
   machine.h is the output of `plotplan machine show`, with the values to adjust in docs/firmware.md. */
#include <plotplan_firmware.h>
#include "machine.h"

void setup() {
  plotplan_setup(&plotplan_machine);
}

void loop() {
  plotplan_loop();
}
