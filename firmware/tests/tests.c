/* Tests of the portable layers on the host, under address and undefined-behaviour sanitizers. */
#include "tests.h"

int main(void) {
    lines_are_answered_as_documented();
    errors_name_the_cause();
    plain_lines_are_answered_without_numbers();
    times_wrap_after_71_minutes();
    damaged_line_is_never_executed();
    random_bytes_do_no_harm();
    full_queue_holds_the_line();
    steps_come_at_their_time();
    cuts_of_long_rows_keep_clear_of_steps();
    setpoints_follow_rows_of_any_length();
    loop_follows_within_a_count();
    duty_saturates_without_windup();
    switch_stops_motors_and_lifts_the_pen();
    stop_command_and_follow_fault();
    homing_finds_the_switch_from_ten_poses();
    homing_fails_without_a_switch();
    homing_finds_a_mechanical_stop_from_ten_poses();
    homing_to_a_stop_fails();
    pens_of_all_kinds();
    printf("%d checks passed, %d failed\n", passed, failed);
    return failed != 0;
}
