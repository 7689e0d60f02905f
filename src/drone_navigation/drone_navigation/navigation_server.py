"""The navigation server: ``ros2 run drone_navigation navigation_server``."""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import os
import sys
from contextlib import ExitStack
from pathlib import Path

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from drone_navigation.process_control.fast_dds import small_histories
from drone_navigation.process_control.ros_arguments import own_arguments
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import EXIT_HUNG, StopSignals
from drone_navigation.server.lateness.lateness_trace import LatenessTrace
from drone_navigation.server.lifecycle.managed_server import ManagedServer
from drone_navigation.server.options import CHECK_TIMEOUT_S, make_parser, overrides
from mavlink_vehicle.errors import DriverError, LinkError
from mavlink_vehicle.io.clock import MonotonicClock
from navigation_bridge.configuration.fleet_config import check_server_wide, make_vehicle_configs
from navigation_bridge.configuration.make_config import ConfigurationError, make_config
from navigation_bridge.configuration.parameter_file import (
    ParameterFile,
    check_parameter_files,
    read_parameter_file,
)
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.trajectories.solver import installed_solver

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
_WATCH_PERIOD_S = 0.5


def main(args: list[str] | None = None) -> int:
    """Run the server until it is stopped; return the exit code."""
    interrupted = "navigation_server: interrupted."
    return run_program("navigation_server", args, _main, EXIT_FAILED, interrupted)


def _main(argv: list[str]) -> int:
    try:
        # First of all: ROS meets a file that cannot be read with a traceback.
        check_parameter_files(argv, SERVER_NODE_NAME)
    except ConfigurationError as error:
        print(f"navigation_server: {error}", file=sys.stderr)
        return EXIT_USAGE
    own = own_arguments(argv)
    ros_arguments = len(own) < len(argv) - 1
    parser = make_parser()
    options = parser.parse_args(own)
    _check_options(parser, options)
    try:
        if options.check or options.computer_row or options.shadow_goals:
            if ros_arguments:
                flag = _without_ros(options)
                raise ConfigurationError(f"{flag} takes --config and --link, not --ros-args.")
            file = ParameterFile({})
            if options.config is not None:
                file = read_parameter_file(Path(options.config), SERVER_NODE_NAME)
            return (_shadow_goals if options.shadow_goals else _check)(options, file)
        if options.config is not None:
            argv = [*argv, "--ros-args", "--params-file", options.config]
            check_parameter_files(argv, SERVER_NODE_NAME)
    except (ConfigurationError, LinkError, OSError) as error:
        print(f"navigation_server: {error}", file=sys.stderr)
        return EXIT_USAGE
    signals = StopSignals("navigation_server")
    os.environ.update(small_histories(os.environ, Path.cwd()))
    try:
        with starting_ros():
            rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:
        print(f"navigation_server: {_first_line(error)}", file=sys.stderr)
        return EXIT_USAGE
    try:
        # A file stands for the user's own vehicle, whatever it contains.
        code = _run(options, argv, "--params-file" not in argv, signals)
        signals.finish(code)
        return code
    finally:
        rclpy.try_shutdown()


def _check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Exit with an error about conflicting options."""
    if options.timeout is not None and not options.check:
        parser.error("--timeout is for --check")
    if options.json and not (options.check or options.shadow_goals):
        parser.error("--json is for --check and --shadow-goals")
    if bool(options.check) + bool(options.computer_row) + bool(options.shadow_goals) > 1:
        parser.error("give one of --check, --computer-row and --shadow-goals")
    if options.no_computer and not options.check:
        parser.error("--no-computer is for --check")
    if options.trace_lateness and (options.check or options.computer_row or options.shadow_goals):
        parser.error("--trace-lateness is for a server that flies")


def _without_ros(options: argparse.Namespace) -> str:
    """Return the option that runs without ROS."""
    if options.shadow_goals:
        return "--shadow-goals"
    return "--check" if options.check else "--computer-row"


def _check(options: argparse.Namespace, file: ParameterFile) -> int:
    """Run ``--check`` or ``--computer-row`` without ROS."""
    # A server that flies does not load the tables and bars of a terminal.
    from drone_navigation.check.command import print_computer_row, run_check  # noqa: PLC0415

    given = overrides(options)
    values = {**file.server, **given}
    if options.config is None and options.link is None:
        values.setdefault("arming", "auto")  # the simulator's set-up, as without --check
    configs = {"": make_config(values)}
    for name, own in file.vehicles.items():
        check_server_wide(name, own, file.server)
    tried = [values]
    if file.vehicles:
        of_vehicles = {name: own | given for name, own in file.vehicles.items()}
        configs = make_vehicle_configs(of_vehicles)
        tried = list(of_vehicles.values())
    if options.computer_row:
        return print_computer_row(tried)
    set_up = "" if options.config is None else Path(options.config).stem
    limit_s = options.timeout or CHECK_TIMEOUT_S
    return run_check(configs, limit_s, options.json, set_up, () if options.no_computer else tried)


def _shadow_goals(options: argparse.Namespace, file: ParameterFile) -> int:
    """Run ``--shadow-goals`` without ROS."""
    from navigation_bridge.recording.shadow_command import run_shadow_goals  # noqa: PLC0415

    if file.vehicles:
        raise ConfigurationError(
            "Shadow goals need a --config with a single vehicle and its target_system."
        )
    config = make_config({**file.server, **overrides(options)})
    return run_shadow_goals(config, Path(options.shadow_goals), options.json)


def _run(
    options: argparse.Namespace, argv: list[str], simulator: bool, signals: StopSignals
) -> int:
    given = [Parameter(name, value=value) for name, value in overrides(options).items()]
    with ExitStack() as on_exit:
        trace = None
        if options.trace_lateness:
            trace = on_exit.enter_context(LatenessTrace().installed())
        server = ManagedServer(given, argv, simulator, MonotonicClock(), trace)
        on_exit.callback(server.close)
        logger = server.node.get_logger()
        if note := installed_solver().NOTE:
            logger.info(note)
        if not server.start():
            return EXIT_USAGE
        second = _watch(server, signals, trace)
        gave_up = not server.running
        if gave_up:
            logger.fatal("The driver thread has failed; the server exits.")
        signals.request()
        try:
            server.stop()
        except DriverError as error:
            logger.fatal(f"{error} The vehicle's own failsafe decides what it does.")
            return EXIT_HUNG
        _log_trace(server.node, trace, ended=True)
        code = EXIT_USAGE if second else EXIT_FAILED if gave_up else EXIT_OK
        # To destroy the nodes of several vehicles takes a busy machine seconds.
        signals.close(code)
        return code


def _watch(server: ManagedServer, signals: StopSignals, trace: LatenessTrace | None) -> str:
    """Wait for the end of the server; return why it must not run, or an empty text."""
    while not signals.wait(_WATCH_PERIOD_S) and server.running:
        _log_trace(server.node, trace, ended=False)
        if second := server.look():
            server.node.get_logger().fatal(second)
            return second
        if server.exit_wanted.is_set():
            signals.wait(_WATCH_PERIOD_S)  # its manager asks for the state that was reached
            break
    return ""


def _log_trace(node: Node, trace: LatenessTrace | None, ended: bool) -> None:
    """Log what a trace has found since the last call."""
    if trace is not None:
        for turn in trace.turns():
            node.get_logger().info(turn.sentence)
        if ended:
            node.get_logger().info(trace.summary)


def _first_line(error: BaseException) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else repr(error)


if __name__ == "__main__":
    sys.exit(main())
