"""The slow and broad tests: `make test` leaves them out, `make test-all` runs them, too.

They try many links, kinds of vehicle, hosts, stations and moments, in real time or at length. What
they are about is held by quicker tests, too, once.
"""

from __future__ import annotations

FILES = frozenset(
    {
        "interop/test_mavproxy.py",
        "interop/test_mavsdk.py",
        "interop/test_mavsdk_px4.py",
        "interop/test_mavsdk_station.py",
        "pair/test_autopilot_logs.py",
        "pair/test_geodesy.py",
        "pair/test_goal_faulty_link.py",
        "pair/test_ground_goals.py",
        "pair/test_hostile_stations.py",
        "pair/test_kinds_against_simulator.py",
        "pair/test_late_server.py",
        "pair/test_loss_matrix.py",
        "pair/test_mission_transfer.py",
        "pair/test_plane_goals.py",
        "pair/test_px4_against_simulator.py",
        "pair/test_px4_kinds_against_simulator.py",
        "pair/test_set_ups.py",
        "pair/test_speed_limits.py",
        "pair/test_stalls.py",
        "pair/test_station_beside_bridge.py",
        "pair/test_stations.py",
        "pair/test_texts_decide_nothing.py",
        "pair/test_two_stations.py",
        "pair/test_vehicle_against_simulator.py",
        "replay/test_compare_command.py",
        "replay/test_read_recordings.py",
        "replay/test_vehicle_recordings.py",
        "ros/test_blocked.py",
        "ros/test_client_commands.py",
        "ros/test_command_line.py",
        "ros/test_console.py",
        "ros/test_console_tiles.py",
        "ros/test_demo.py",
        "ros/test_driver_failure.py",
        "ros/test_fleet.py",
        "ros/test_hosts.py",
        "ros/test_link.py",
        "ros/test_logs.py",
        "ros/test_lost_server.py",
        "ros/test_missed_waypoint.py",
        "ros/test_nav2.py",
        "ros/test_phases.py",
        "ros/test_replay.py",
        "ros/test_set_ups.py",
        "ros/test_signing.py",
        "ros/test_stations.py",
        "ros/test_stopped_server.py",
        "ros/test_tlog2mcap.py",
        "ros/test_two_servers.py",
        "ros/test_velocity.py",
        "unit/sitl/test_accepted_commands.py",
        "unit/sitl/test_kinds_hostile.py",
        "unit/sitl/test_parameters_matter.py",
        "unit/test_wheels.py",
    }
)
"""Of these, all tests."""

PARTS = {
    "explore/test_explore.py": (
        "test_what_was_found_stays_mended[return_asked_for_on_touchdown",
        "test_what_was_found_stays_mended[rover_drives_each_lap_once",
        "test_what_was_found_stays_mended[slow_goal_takes_over_at_speed",
    ),
    "pair/test_odom.py": ("[copter-px4", "[rover-px4"),
    "pair/test_storage.py": (
        "-bad radio",
        "test_lists_are_written_read_back_replaced_and_removed[px4",
        "test_an_upload_that_is_cut_off_is_repaired_when_the_link_is_back[2",
        "test_many_are_changed_and_each_is_accounted_for[ardupilot-lossy",
    ),
    "pair/test_velocity.py": (
        "[copter-px4",
        "[boat-",
        "test_it_stops_in_front_of_what_its_sensor_sees[rover-ardupilot",
        "test_when_the_commands_stop_the_vehicle_stops_and_the_goal_ends[rover-ardupilot",
        "test_a_cancel_and_the_hold_service_stop_it_and_commands_do_not_undo_that[rover-ardupilot",
    ),
    "ros/test_client.py": ("test_a_killed_client_gives_the_terminal_back",),
    "ros/test_navigate.py": ("test_base_link_is_relative_to_the_vehicle",),
    "ros/test_actions.py": ("test_a_place_on_earth_and_a_return_that_is_cancelled",),
    "ros/test_storage.py": ("test_the_commands_of_the_client",),
    "pair/test_driving.py": (
        "test_nor_by_a_rover_that_may_only_turn_slowly[target0-45.0",
        "test_nor_by_a_rover_that_may_only_turn_slowly[target1-30.0",
        "test_nor_by_a_rover_that_may_only_turn_slowly[target2",
        "test_nor_by_a_rover_that_may_only_turn_slowly[target3",
        "test_a_stop_ends_without_a_turn[ardupilot-boat",
        "test_a_stop_ends_without_a_turn[px4-rover",
        "test_a_route_that_missed_a_waypoint_does_not_succeed[px4",
        "test_it_turns_back_for_a_waypoint_if_it_is_to[px4",
        "test_corners_are_met_within_half_a_metre[px4",
    ),
    "pair/test_goal_life_cycle.py": (
        "test_ground_speed_stays_within_the_goal[0.5",
        "test_ground_speed_stays_within_the_goal[3.0",
    ),
    "pair/test_missions.py": (
        "test_a_plane_takes_off_flies_its_mission_and_circles_its_end[px4",
        "test_a_pause_holds_and_continues_with_the_same_item[px4",
        "test_a_mission_on_a_bad_link_is_flown_to_its_end[bad",
        "test_a_mission_on_a_bad_link_is_flown_to_its_end[loss-px4",
        "test_a_copter_on_the_ground_takes_off_and_flies_its_mission_to_the_end[px4",
        "test_a_rover_drives_its_mission[px4",
        "test_a_cancel_holds_and_removes_the_mission[px4",
        "test_a_silence_of_three_seconds_ends_no_mission[UPLOADING-px4",
        "test_a_silence_of_three_seconds_ends_no_mission[ARMING",
        "test_a_silence_of_three_seconds_ends_no_mission[NAVIGATING-ardupilot",
    ),
    "pair/test_obstacle_flights.py": ("[copter through a gap", "[PX4 copter out of a pocket"),
    "pair/test_obstacles.py": (
        "_while_the_vehicle_flies_and_turns[copter-px4",
        "_while_the_vehicle_flies_and_turns[rover",
    ),
    "pair/test_position_doubt.py": (
        "test_a_glitch_that_passes_is_waited_for[copter-px4",
        "test_a_glitch_that_passes_is_waited_for[rover",
        "_ends_the_goal_where_the_vehicle_stopped[copter-0.0",
        "_ends_the_goal_where_the_vehicle_stopped[copter-9.0",
        "test_a_goal_long_after_a_jump_reports_the_jump",
        "_ends_the_goal_where_the_vehicle_stopped[rover",
        "test_a_jump_without_a_word_before_it_is_seen_at_once[px4",
        "test_a_glitch_at_the_target_is_no_success_beside_it[px4",
        "test_no_goal_begins_while_the_position_is_in_doubt[px4",
        "test_a_landing_and_a_return_continue_and_say_it[land-px4",
        "test_a_landing_and_a_return_continue_and_say_it[return-px4",
        "test_a_mission_is_held_and_continues[px4",
        "test_a_plane_circles_meanwhile[px4",
        "test_a_flight_without_a_glitch_is_never_in_doubt[rover",
        "test_a_flight_without_a_glitch_is_never_in_doubt[boat",
        "test_a_flight_without_a_glitch_is_never_in_doubt[copter-px4",
        "test_a_flight_without_a_glitch_is_never_in_doubt[plane",
        "test_a_cancel_while_the_position_is_in_doubt_stops_by_the_velocity[px4",
        "test_what_the_autopilot_does_about_a_lost_fix_is_its_own_failsafe[px4",
    ),
    "pair/test_rehearsal.py": (
        "test_a_goal_takes_as_long_as_it_was_rehearsed",
        "test_a_route_with_a_hold_is_rehearsed[PX4",
        "test_a_route_with_a_hold_is_rehearsed[ArduRover",
        "test_a_lost_link_ends_as_the_failsafe_says[PX4",
    ),
    "property/test_core_avoidance.py": (
        "test_a_route_hits_nothing_and_ends",
        "test_a_flight_to_a_point_hits_nothing_and_ends",
    ),
    "property/test_mutated_replays.py": ("test_a_goal_on_a_damaged_recording",),
    "replay/test_golden.py": ("[ardupilot/", "[px4/", "[real/"),
    "replay/test_recorded_rules.py": ("_acknowledged_in_the_same_order[mission_clear",),
    "unit/core/test_bounded.py": (
        "test_every_task_ends_whatever_the_vehicle_does[goto of a rover",
        "test_a_pause_that_is_lifted_does_not_take_the_bounds_away[goto of a rover",
        "test_a_pause_that_is_lifted_does_not_take_the_bounds_away[goto of a PX4",
    ),
    "unit/core/test_late_searches.py": (
        "_joined_without_a_jump[0.0",
        "_joined_without_a_jump[0.1",
    ),
    "unit/core/test_movers.py": (
        "test_the_velocity_of_what_moves_is_found[begin1",
        "test_the_velocity_of_what_moves_is_found[begin2-velocity2-0.5-0.0",
        "test_the_velocity_of_what_moves_is_found[begin0-velocity0-0.5-2.0",
    ),
    "pair/test_px4_goals.py": (
        "test_a_px4_that_disarmed_in_offboard",
        "test_a_goal_that_replaces_another_continues_in_offboard",
        "test_a_goal_right_after_another_takes_it_out_of_hold_again",
        "test_a_fast_flight_stops_at_its_goal_and_not_beyond",
        "test_take_off_land_and_return",
        "test_the_arm_service_leaves_offboard_first",
    ),
    "unit/navigation/test_flight_pictures.py": (
        "test_mp4_and_gif_show_the_same_moments",
        "test_any_tlog_is_drawn[rover",
        "test_any_tlog_is_drawn[offboard",
    ),
    "unit/sitl/test_fuzz.py": (
        "test_a_million_hostile_frames_do_no_harm",
        *("[boat-", "[plane-ardupilot", "[rover-"),
    ),
    "unit/sitl/test_world.py": ("test_gps_noise_of_the_world",),
    "unit/sitl/test_px4_hostile.py": (
        "_do_not_stop_other_kinds[boat",
        "test_absurd_parameters_do_not_stop_other_kinds",
        "test_absurd_parameters_do_not_stop_a_flight[1e",
        "test_absurd_parameters_do_not_stop_a_flight[0",
    ),
}
"""Of these, the tests whose names, with parameters, hold one of these.

A kind of vehicle, a speed, a link or a recording of each remains quick. That hostile frames do no
harm is held by 20,000 of them, too.
"""


def is_left_out(file: str, marks: str) -> bool:
    """Tell whether a run of the tests with these marks needs nothing of a file.

    Importing it would cost each worker time.

    Args:
        file: from the folder of the tests on.
        marks: the expression that was given as ``-m``.
    """
    if marks == "not wide":
        return file in FILES
    return marks == "wide" and file not in FILES and file not in PARTS


def is_wide(file: str, name: str) -> bool:
    """Tell whether a test is one of them.

    Args:
        file: its file, from the folder of the tests on.
        name: its name, with its parameters.
    """
    if file in FILES:
        return True
    return any(part in name for part in PARTS.get(file, ()))
