"""The console: ``ros2 run drone_navigation navigation_console``."""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import asyncio
import os
import sys
import threading
import webbrowser
from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from drone_navigation.console.fleet import Fleet
from drone_navigation.console.options import TokenError, make_parser, token_of
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.console.tiles.folder import TileError, Tiles
from drone_navigation.console.tiles.source import open_tiles
from drone_navigation.process_control.ros_arguments import own_arguments
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import StopSignals

if TYPE_CHECKING:
    from drone_navigation.console.web import Web

_REDIRECT = '<!doctype html><meta http-equiv="refresh" content="0; url={address}">\n'
_NO_WEBSOCKETS = (
    "The console needs the package websockets ({error}): sudo apt install python3-websockets, or "
    "'pip install websockets'."
)
EXIT_OK = 0
EXIT_FAILED = 1
_WATCH_PERIOD_S = 0.1


def main(args: list[str] | None = None) -> int:
    """Serve the console until a signal; return the exit code."""
    return run_program("navigation_console", args, _main, EXIT_OK)


def _main(argv: list[str]) -> int:
    parser = make_parser()
    options = parser.parse_args(own_arguments(argv))
    try:
        token = token_of(options)
        tiles = open_tiles(options.tiles) if options.tiles else None
    except (TokenError, TileError) as error:
        parser.error(str(error))
    signals = StopSignals("navigation_console")
    code = _serve_until(signals, argv, options, token, tiles)
    signals.finish(code)
    return code


def _serve_until(
    signals: StopSignals, argv: list[str], options: Namespace, token: str, tiles: Tiles | None
) -> int:
    try:
        from drone_navigation.console.web import Web  # noqa: PLC0415 - may be missing
    except ModuleNotFoundError as error:
        print(_NO_WEBSOCKETS.format(error=error), file=sys.stderr)
        return EXIT_FAILED
    with ExitStack() as on_exit:
        # Only for its owner: a command line, with the address on it, is for everybody.
        folder = on_exit.enter_context(TemporaryDirectory(prefix="navigation_console_"))
        on_exit.callback(rclpy.try_shutdown)
        with starting_ros():
            rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
            node = Node("navigation_console")
        on_exit.callback(node.destroy_node)
        board = ShownValues()
        fleet = Fleet(node, board)
        fleet.start()
        on_exit.callback(fleet.stop)

        def ready(port: int) -> None:
            address = f"http://{options.host}:{port}/?token={token}"
            print(f"The console is at {address}", flush=True)
            print(
                "Anyone with this address can fly the vehicles. Ctrl-C ends the console.",
                flush=True,
            )
            # Without a display it would be a browser in this terminal.
            display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
            if display and not options.no_browser:
                file = Path(folder, "console.html")
                file.write_text(_REDIRECT.format(address=address), "utf-8")
                threading.Thread(target=webbrowser.open, args=(file.as_uri(),), daemon=True).start()

        try:
            web = Web(fleet, board, token, tiles)
            asyncio.run(_serve(signals, web, options.host, options.port, ready))
        except OSError as error:
            print(f"Cannot listen on {options.host}: {error.strerror or error}.", file=sys.stderr)
            return EXIT_FAILED
    print("The console has ended; active goals continue.", flush=True)
    return EXIT_OK


async def _serve(
    signals: StopSignals, web: Web, host: str, port: int, ready: Callable[[int], None]
) -> None:
    watch = asyncio.create_task(_watch(signals, web))
    try:
        await web.run(host, port, ready)
    finally:
        watch.cancel()


async def _watch(signals: StopSignals, web: Web) -> None:
    while not signals.is_requested:
        await asyncio.sleep(_WATCH_PERIOD_S)
    web.stop()


if __name__ == "__main__":
    sys.exit(main())
