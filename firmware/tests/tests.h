/* What the tests share. The port and the drive are fakes; time is a number of milliseconds. */
#ifndef PLOTPLAN_TESTS_H
#define PLOTPLAN_TESTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "drive.h"
#include "machine.h"
#include "port.h"

extern int passed, failed;
void check(int holds, const char *what, const char *file, int line);
#define CHECK(condition) check(!!(condition), #condition, __FILE__, __LINE__)
uint32_t random32(void);
uint32_t random_below(uint32_t n);

/* ---- the fake port ---- */
extern uint8_t closed_switches;
extern uint16_t servo_us;
extern int solenoid, z_steps;

/* ---- the fake drive: where it is and what holds it (harness.c) ---- */
extern int32_t drive_at[2], switch_at, physical, stop_at, sticks_at;
extern bool hold, halted, measures, switch_fitted, stop_fitted, jammed, seeks;
extern uint8_t held_back, sought_motors;
extern struct drive fake_drive;
void update_switch(void);

/* The machine of the tests, as after power-up. */
extern struct plotplan_machine config;
void fresh(void);
/* Sends bytes as they are; the last answer without its line end, "" without one. */
const char *raw(const char *bytes, size_t length);
/* TEXT*SUM and a line end. */
void frame(char *to, const char *text);
/* Sends a line with its checksum; the answer's text if its checksum is right. */
const char *framed(const char *text);
int answers(const char *text, const char *expected);
void finish_motion(void);

/* lines_tests.c */
void lines_are_answered_as_documented(void);
void errors_name_the_cause(void);
void plain_lines_are_answered_without_numbers(void);
void times_wrap_after_71_minutes(void);
void damaged_line_is_never_executed(void);
void random_bytes_do_no_harm(void);
void full_queue_holds_the_line(void);

/* motion_tests.c */
void steps_come_at_their_time(void);
void cuts_of_long_rows_keep_clear_of_steps(void);
void setpoints_follow_rows_of_any_length(void);
void loop_follows_within_a_count(void);
void duty_saturates_without_windup(void);

/* homing_tests.c */
void switch_stops_motors_and_lifts_the_pen(void);
void stop_command_and_follow_fault(void);
void homing_finds_the_switch_from_ten_poses(void);
void homing_fails_without_a_switch(void);
void homing_finds_a_mechanical_stop_from_ten_poses(void);
void homing_to_a_stop_fails(void);
void pens_of_all_kinds(void);

#endif
