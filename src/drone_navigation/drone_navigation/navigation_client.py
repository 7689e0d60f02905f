"""The navigation client: ``ros2 run drone_navigation navigation_client``."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import ExitStack
from types import FrameType

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from drone_navigation.client.commands import run_command
from drone_navigation.client.errands import make_errand
from drone_navigation.client.keys import Keyboard
from drone_navigation.client.logs import run_log_command
from drone_navigation.client.options import (
    LOG_COMMANDS,
    SERVICE_COMMANDS,
    make_command_parser,
    make_parser,
    parse_options,
)
from drone_navigation.client.session import NavigationClient
from drone_navigation.client.storage import StorageCommand, prepare
from drone_navigation.client.storage_options import STORAGE_COMMANDS
from drone_navigation.client.view import make_view
from navigation_bridge.goals.plan_files import PlanError
from navigation_bridge.storage.parameter_files import ParameterFileError

# DECTCEM, past what holds back output: the process ends in the middle of whatever it draws.
_SHOW_CURSOR = b"\n\x1b[?25h"


def main(args: list[str] | None = None) -> int:
    """Send a goal or run a command, and return the exit code."""
    argv = list(sys.argv if args is None else ["navigation_client", *args])
    options = parse_options(remove_ros_args(argv)[1:])
    if options.command in SERVICE_COMMANDS:
        return run_command(options, argv)
    if options.command in STORAGE_COMMANDS:
        try:
            options.task = prepare(options)
        except (PlanError, ParameterFileError) as error:
            make_command_parser(options.command).error(str(error))
        return run_command(options, argv, StorageCommand)
    if options.command in LOG_COMMANDS:
        return run_log_command(options, argv)
    try:
        errand = make_errand(options)
    except PlanError as error:
        make_parser().error(str(error))
    with ExitStack() as on_exit:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
        on_exit.callback(rclpy.try_shutdown)
        node = Node("navigation_client", namespace=options.vehicle)
        on_exit.callback(node.destroy_node)
        # Keys need a terminal for the output.
        people = sys.stdin.isatty() and sys.stdout.isatty() and not options.json
        keyboard = Keyboard(sys.stdin) if people else None
        if keyboard is not None:
            on_exit.callback(keyboard.close)
        view = make_view(plain=options.plain, json=options.json, keys=people)
        on_exit.callback(view.close)
        client = NavigationClient(node, view, errand, options, keyboard)
        on_exit.callback(client.close)
        _handle_signals(client, keyboard)
        return client.run()


def _handle_signals(client: NavigationClient, keyboard: Keyboard | None) -> None:
    def interrupt(_number: int, _frame: FrameType | None) -> None:
        client.interrupt()

    def quit_at_once(number: int, _frame: FrameType | None) -> None:
        assert keyboard is not None
        keyboard.close()
        os.write(sys.stdout.fileno(), _SHOW_CURSOR)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def suspend(_number: int, _frame: FrameType | None) -> None:
        client.suspend()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)
    if keyboard is not None:
        signal.signal(signal.SIGQUIT, quit_at_once)
        signal.signal(signal.SIGTSTP, suspend)


if __name__ == "__main__":
    sys.exit(main())
