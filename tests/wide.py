"""Which tests are slow and broad: `make test` leaves them out, `make test-all` runs them, too.

They try many links, kinds of vehicle, hosts, stations and moments, in real time or at length. What
they are about is held by quicker tests, too, once.
"""

from __future__ import annotations

FILES = frozenset(
    {
        "interop/test_mavproxy.py",
        "interop/test_mavsdk.py",
        "interop/test_mavsdk_station.py",
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
        "ros/test_demo.py",
        "ros/test_driver_failure.py",
        "ros/test_fleet.py",
        "ros/test_hosts.py",
        "ros/test_link.py",
        "ros/test_lost_server.py",
        "ros/test_missed_waypoint.py",
        "ros/test_phases.py",
        "ros/test_replay.py",
        "ros/test_set_ups.py",
        "ros/test_signing.py",
        "ros/test_stations.py",
        "ros/test_stopped_server.py",
        "ros/test_tlog2mcap.py",
        "ros/test_two_servers.py",
    }
)
"""Of these, all tests."""

PARAMETERS = {"replay/test_golden.py": ("ardupilot/", "px4/", "real/")}
"""Of these, the tests whose parameters begin so: the large recordings."""


def is_left_out(file: str, marks: str) -> bool:
    """Tell whether a run of the tests with these marks needs nothing of a file.

    Importing it would cost each worker time.

    Args:
        file: from the folder of the tests on.
        marks: the expression that was given as ``-m``.
    """
    if marks == "not wide":
        return file in FILES
    return marks == "wide" and file not in FILES and file not in PARAMETERS


def is_wide(file: str, name: str) -> bool:
    """Tell whether a test is one of them.

    Args:
        file: its file, from the folder of the tests on.
        name: its name, with its parameters.
    """
    if file in FILES:
        return True
    return any(f"[{begin}" in name for begin in PARAMETERS.get(file, ()))
