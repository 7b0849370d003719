// Solves one stance and prints when the leg takes off. SPDX-License-Identifier: MIT-0
#include <@prefix@.h>

static @prefix@_plan_@real@ plan;
static @prefix@_phase_@real@ phases[32];

void setup() {
  Serial.begin(115200);
  const @prefix@_robot_@real@ robot = {25.0f, 3.0f, 1200.0f, 0.4f, 0.0f, 150.0f, 5.0f, 0.78f, 0.6f, -65.0f, 9.81f, 0.0f, 0.08f, 3.0f, 0.05f};
  if (@prefix@_plan_init_@real@(&plan, &robot) != @PREFIX@_OK) {
    Serial.println("bad robot");
  }
}

void loop() {
  const @prefix@_state_@real@ touchdown = {0.0f, 0.0f, -1.93f, 0.0f};
  const @prefix@_step_@real@ current = {0.0f, 3.0f};
  @prefix@_stance_@real@ stance;
  const int32_t status = @prefix@_solve_stance_@real@(&plan, &touchdown, &current, 1, 2.0f, 32, phases, 32, &stance);
  Serial.print(status);
  Serial.print(" take-off after ");
  Serial.println(stance.duration, 6);
  delay(1000);
}
