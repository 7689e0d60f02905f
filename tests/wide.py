"""The slow and broad tests: `make test` leaves them out, `make test-all` runs them, too.

They try many links, kinds of vehicle, hosts, stations and moments, in real time or at length.
Quicker tests hold the same once. Of those with more than two sets of parameters, `make test-all`
runs the first and the last; `make test-night` runs all.
"""

from __future__ import annotations

from collections.abc import Sequence

FILES = frozenset(
    {
        "bench/test_short_forms.py",
        "fleets/test_hangs.py",
        "fleets/test_many_encounters.py",
        "fleets/test_many_fleets.py",
        "interop/test_mavsdk.py",
        "interop/test_mavsdk_px4.py",
        "interop/test_mavsdk_station.py",
        "pair/test_autopilot_logs.py",
        "pair/test_external_position.py",
        "pair/test_geodesy.py",
        "pair/test_goal_faulty_link.py",
        "pair/test_ground_goals.py",
        "pair/test_hostile_stations.py",
        "pair/test_kinds_against_simulator.py",
        "pair/test_late_server.py",
        "pair/test_loss_matrix.py",
        "pair/test_mission_transfer.py",
        "pair/test_odom.py",
        "pair/test_plane_goals.py",
        "pair/test_position_doubt.py",
        "pair/test_px4_against_simulator.py",
        "pair/test_px4_kinds_against_simulator.py",
        "pair/test_rehearsal.py",
        "pair/test_set_ups.py",
        "pair/test_speed_limits.py",
        "pair/test_stalls.py",
        "pair/test_station_beside_bridge.py",
        "pair/test_stations.py",
        "pair/test_texts_decide_nothing.py",
        "pair/test_two_stations.py",
        "pair/test_vehicle_against_simulator.py",
        "pair/test_velocity.py",
        "property/test_conversations_kept_apart.py",
        "property/test_mutated_replays.py",
        "replay/test_compare_command.py",
        "replay/test_read_recordings.py",
        "replay/test_recorded_projections.py",
        "replay/test_vehicle_recordings.py",
        "ros/test_actions.py",
        "ros/test_blocked.py",
        "ros/test_client_commands.py",
        "ros/test_command_line.py",
        "ros/test_console.py",
        "ros/test_console_tiles.py",
        "ros/test_demo.py",
        "ros/test_driver_failure.py",
        "ros/test_external_odometry.py",
        "ros/test_fleet.py",
        "ros/test_hosts.py",
        "ros/test_link.py",
        "ros/test_logs.py",
        "ros/test_lost_server.py",
        "ros/test_missed_waypoint.py",
        "ros/test_nav2.py",
        "ros/test_phases.py",
        "ros/test_replay.py",
        "ros/test_ros_clock.py",
        "ros/test_rtcm.py",
        "ros/test_set_ups.py",
        "ros/test_shown_commands.py",
        "ros/test_signing.py",
        "ros/test_stations.py",
        "ros/test_stopped_server.py",
        "ros/test_storage.py",
        "ros/test_tlog2mcap.py",
        "ros/test_topics.py",
        "ros/test_traffic_hosts.py",
        "ros/test_two_servers.py",
        "ros/test_velocity.py",
        "unit/navigation/test_tlog2mcap.py",
        "unit/test_make_targets.py",
        "unit/test_simulator_alone.py",
        "unit/test_wheels.py",
    }
)
"""Of these, all tests."""

FIRST_ONLY = (
    "explore/",
    "fleets/test_encounters.py",
    "fleets/test_plane_encounters.py",
    "interop/",
    "pair/",
    "replay/",
    "unit/core/test_bounded.py",
    "unit/core/test_follow_velocity.py",
    "unit/core/test_late_searches.py",
    "unit/core/test_movers.py",
    "unit/core/test_room.py",
    "unit/logs/test_own_logs.py",
    "unit/navigation/test_one_track.py",
    "unit/test_packaging.py",
)
"""Of these folders and files, each test but with the first of its parameters.

They fly. A kind of vehicle, a speed, a link or a recording of each remains quick.
"""

PARTS = {
    "fleets/test_crossing.py": (
        "test_a_landing_waits",
        "test_a_lost_link",
        "test_a_target_of_another_is_moved",
        "test_a_target_of_another_is_waited",
        "test_four_copters_cross",
        "test_motors_that_fail",
        "test_without_separation_they_collide",
    ),
    "fleets/test_encounters.py": (
        "test_a_px4_keeps_apart",
        "test_an_evasion_stays",
        "test_vehicles_that_evade",
    ),
    "fleets/test_plane_encounters.py": (
        "test_a_plane_that_circles",
        "test_a_paused_plane",
        "test_an_evasion_of_a_plane",
        "test_a_plane_keeps_apart_wherever",
        "without_traffic",
    ),
    "fleets/test_reported_traffic.py": ("near_is_no_echo",),
    "interop/test_report.py": (
        "test_nothing_is_cut_off_at_any_width",
        "test_two_flights_are_laid_over_each_other",
    ),
    "pair/test_crossed_modes.py": ("a_second_change", "not_overtaken_for_good"),
    "pair/test_missions.py": (
        "test_a_mission_on_a_bad_link",
        "test_laps_stays_headings",
    ),
    "pair/test_obstacle_flights.py": ("test_a_goal_is_reached_by_replanning",),
    "pair/test_px4_goals.py": (
        "test_a_px4_that_disarmed_in_offboard",
        "test_a_goal_that_replaces_another_continues_in_offboard",
        "test_a_goal_right_after_another_takes_it_out_of_hold_again",
        "test_a_fast_flight_stops_at_its_goal_and_not_beyond",
        "test_take_off_land_and_return",
        "test_the_arm_service_leaves_offboard_first",
    ),
    "pair/test_server_too_late.py": (
        "test_a_hang_is_not_held",
        "again_and_again",
        "test_data_that_is_old",
    ),
    "property/test_core_avoidance.py": (
        "test_a_route_hits_nothing_and_ends",
        "test_a_flight_to_a_point_hits_nothing_and_ends",
    ),
    "property/test_core_goto.py": ("test_every_flight_ends_once_and_honestly",),
    "property/test_core_obstacle_map.py": (
        "test_everything_is_the_same_a_whole_number_of_columns_further_on",
        "test_whatever_it_reads",
    ),
    "property/test_core_pursuit.py": ("test_any_target_is_reached_without_circles",),
    "property/test_damaged_logs.py": ("test_every_whole_packet_of_a_damaged_log_is_read",),
    "ros/test_client.py": (
        "test_a_killed_client_gives_the_terminal_back",
        "test_an_update_after_the_arrival_continues_from_there",
    ),
    "ros/test_stop.py": (
        "test_a_stop_ends_the_process",
        "test_a_stop_during_the_start",
        "test_a_vehicle_too_fast",
        "test_a_goal_that_is_stopped",
        "hangs",
    ),
    "ros/test_navigate.py": ("test_base_link_is_relative_to_the_vehicle",),
    "unit/core/test_avoidance.py": (
        "test_a_long_route_that_cannot_be_planned_on",
        "test_a_pause_while_blocked_stops_the_clock",
    ),
    "unit/navigation/test_one_track.py": ("test_the_recording_of_a_server",),
    "unit/navigation/test_flight_pictures.py": (
        "test_mp4_and_gif_show_the_same_moments",
        "test_any_tlog_is_drawn[rover",
        "test_any_tlog_is_drawn[offboard",
    ),
    "unit/test_packaging.py": ("test_simulator_installs_on_its_own",),
}
"""Of these, the tests whose names, with parameters, hold one of these."""


EVERY = frozenset(
    {"bench/test_short_forms.py", "ros/test_shown_commands.py", "unit/test_make_targets.py"}
)
"""Of these, all parameters by day: each is another program."""

NIGHT: dict[str, tuple[str, ...]] = {
    "fleets/test_hangs.py": ("[5-3]",),
    "fleets/test_many_encounters.py": ("turn_hard", "[boat-"),
    "fleets/test_many_fleets.py": (
        "test_eight_simulated_copters_cross[6",
        "joins_no_two_vehicles[22",
        "test_mixed_kinds_cross",
    ),
    "interop/test_mavsdk_px4.py": ("[land]",),
    "pair/test_goal_faulty_link.py": ("whatever_happens",),
    # A stopped server beside what moves is flown by test_stalls.py, too.
    "pair/test_late_server.py": ("again_and_again",),
    # The copter's demo runs by day.
    "ros/test_demo.py": ("[rover",),
    # Once it was cut off for longer than DDS remembers, on a loaded machine.
    "ros/test_hosts.py": ("test_a_host_that_is_cut_off",),
    "ros/test_stopped_server.py": ("again_and_again",),
    # For each Python of the machine it compiles the interfaces.
    "unit/test_make_targets.py": ("[wheels]", "[demo-nav2-"),
}
"""Wide tests that take long: those whose names, with parameters, hold one of these."""


def is_left_out(file: str, marks: str) -> bool:
    """Return whether a run of the tests with these marks needs nothing of a file.

    Importing it would cost each worker time.

    Args:
        file: from the folder of the tests on.
        marks: the expression that was given as ``-m``.
    """
    if marks == "not wide":
        return file in FILES
    in_part = file in PARTS or file.startswith(FIRST_ONLY)
    return marks.startswith("wide") and file not in FILES and not in_part


def is_wide(file: str, name: str, *, is_first: bool) -> bool:
    """Return whether a test is one of them.

    Args:
        file: its file, from the folder of the tests on.
        name: its name, with its parameters.
        is_first: whether no other parameters of the same function came before.
    """
    if file in FILES or (not is_first and file.startswith(FIRST_ONLY)):
        return True
    return any(part in name for part in PARTS.get(file, ()))


def of_the_night(wide: Sequence[tuple[str, str]]) -> set[int]:
    """Return which of the wide tests only `make test-night` runs.

    Args:
        wide: of each test its file, from the folder of the tests on, and its name with its
            parameters; in the order of collection.

    Returns:
        Places in ``wide``.
    """
    last = {(file, _function(name)): place for place, (file, name) in enumerate(wide)}
    found, seen = set(), set()
    for place, (file, name) in enumerate(wide):
        function = (file, _function(name))
        in_the_middle = function in seen and place != last[function] and file not in EVERY
        seen.add(function)
        if in_the_middle or any(part in name for part in NIGHT.get(file, ())):
            found.add(place)
    return found


def _function(name: str) -> str:
    return name.partition("[")[0]
