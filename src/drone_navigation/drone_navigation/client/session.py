"""Main loop of the navigation client: follows its goals and handles keys and signals."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from types import FrameType

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.task import Future
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from custom_interfaces.action import Navigate, NavigateWaypoints, Orbit
from drone_navigation.client.client_goal import ClientGoal, make_client_goal, make_point_client_goal
from drone_navigation.client.course import Course
from drone_navigation.client.events import Exit
from drone_navigation.client.goals import RESPONSE_TIMEOUT_S
from drone_navigation.client.options import (
    EXIT_ABORTED,
    EXIT_CANCELED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
    EXIT_SUCCESS,
)
from drone_navigation.client.process import SPIN_S, client_node, end_without_server, wait_for
from drone_navigation.client.servers import no_server
from drone_navigation.client.terminal.keys import HELP, Key, Keyboard, Keys, Pressed
from drone_navigation.client.terminal.output import ClientView, make_view
from drone_navigation.client.updates import Update, UpdateError, parse_point
from drone_navigation.presence import duplicate
from drone_navigation.qos import LATCHED_QOS
from navigation_bridge.names import SERVER_NODE_NAME

# Two processes that run already find each other in less.
_SOON_S = 3.0
# What is latched comes within this time, if it comes.
_LATCHED_S = 0.2
# A server says at once that it is there; one that was killed stays in the graph for a while.
_SERVERS_S = 1.5
# A server without a status is not ours, but ours may be beside it, not discovered yet: DDS repeats
# the announcement of a participant every 3 s. Two of these periods, as one may be lost.
_STRANGER_S = 6.5
_AVOIDING = (Navigate.Goal, NavigateWaypoints.Goal, Orbit.Goal)
_AVOIDED = (
    "Obstacles are avoided, because the vehicle has sensors or known obstacles; "
    "--straight flies straight."
)
# DECTCEM, past what holds back output: the process ends in the middle of whatever it draws.
_SHOW_CURSOR = b"\n\x1b[?25h"


class NavigationClient:
    """Sends a goal and its successors, and shows their progress.

    Attributes:
        gave_up: whether the server did not answer any more, or was not waited for.
    """

    def __init__(
        self,
        node: Node,
        view: ClientView,
        client_goal: ClientGoal,
        options: argparse.Namespace,
        keyboard: Keyboard | None,
    ) -> None:
        """Prepare on ``node``.

        Args:
            node: the client's own.
            view: what shows it all.
            client_goal: the first goal.
            options: the command line.
            keyboard: where keys come from, if from anywhere.
        """
        self._node = node
        self._view = view
        self._client_goal = client_goal
        self._options = options
        self._keyboard = keyboard
        self._keys = Keys()
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._course = Course(node, view, client_goal, options.lost_timeout)
        self._services = {
            key: node.create_client(Trigger, f"{SERVER_NODE_NAME}/{key.name.lower()}")
            for key in (Key.PAUSE, Key.RESUME)
        }
        self._calls: list[tuple[Future, float]] = []
        self._updates: deque[Update] = deque(options.update)
        self._interrupts = 0
        self._interrupted = False
        self._suspended = False
        self._cancelling = False
        self._waiting = False
        self.gave_up = False
        self._obstacles: Subscription | None = None
        self._knows_obstacles = False
        # Without an option, obstacles are avoided wherever the vehicle may know any.
        if options.avoid is None:
            topic = f"{SERVER_NODE_NAME}/obstacles"
            self._obstacles = node.create_subscription(
                MarkerArray, topic, self._see_obstacles, LATCHED_QOS
            )

    def interrupt(self) -> None:
        """Cancel the goal (first call) or give up waiting (second call)."""
        self._interrupts += 1

    def suspend(self) -> None:
        """Stop as Ctrl-Z asks, with the next turn of the loop."""
        self._suspended = True

    def close(self) -> None:
        """End the executor while ROS is there: what is left of it would complain on stderr."""
        self._executor.shutdown(timeout_sec=1.0)

    def run(self) -> int:
        """Send the first goal and follow it and its successors to their results.

        Returns:
            The exit code.
        """
        code = self._run()
        self._course.tell(Exit(code))
        return code

    def _run(self) -> int:
        course = self._course
        if not self._wait(course.server_is_ready, min(_SOON_S, self._options.server_timeout)):
            course.say("Waiting for a server")
        if not self._wait(course.server_is_ready, self._options.server_timeout):
            return self._without_server()
        if not self._wait(course.servers_are_known, _SERVERS_S) and not course.servers:
            course.say("The server reports no status; looking for others")
            self._wait(lambda: course.servers > 0, _STRANGER_S)
        # One that has just ended may still be spoken of.
        alone = self._wait(lambda: not course.several_servers, _SERVERS_S)
        if self._interrupts:
            return self._without_server()
        if not alone:
            course.say(f"No goal was sent. {duplicate(self._node)}", bad=True)
            return EXIT_REJECTED
        if course.servers:
            # A key may be pressed at once.
            services = self._services.values()
            self._wait(lambda: all(service.service_is_ready() for service in services), _SERVERS_S)
        for note in self._client_goal.notes:
            course.say(note)
        goal = self._client_goal.goal
        if isinstance(goal, _AVOIDING) and self._chooses_avoidance():
            goal.avoid_obstacles = True
            course.say(_AVOIDED)
        course.send(self._client_goal)
        code = None
        while code is None:
            self._spin_once()
            code = self._step(time.monotonic())
        return code

    def _see_obstacles(self, _message: MarkerArray) -> None:
        self._knows_obstacles = True

    def _chooses_avoidance(self) -> bool:
        """Avoid obstacles by default, if the server publishes some or may come to know some.

        Returns:
            Whether that is so, and was not decided before.
        """
        if self._obstacles is None:
            return False
        self._wait(lambda: self._knows_obstacles, _LATCHED_S)
        self._node.destroy_subscription(self._obstacles)
        self._obstacles = None
        self._options.avoid = self._knows_obstacles
        return self._knows_obstacles

    def _without_server(self) -> int:
        if self._interrupts:
            self._course.say("Interrupted; no goal was sent.", bad=True)
            return EXIT_CANCELED
        self._course.say(no_server(self._node, self._client_goal.name), bad=True)
        return EXIT_NO_SERVER

    def _wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        return wait_for(condition, timeout_s, self._spin_once, lambda: self._interrupts > 0)

    def _spin_once(self) -> None:
        self._executor.spin_once(timeout_sec=SPIN_S)
        # Not in the signal's handler: it may run in the middle of a drawing, and what it prints
        # then is held back until that drawing continues, after the stop.
        if self._suspended and self._keyboard is not None:
            self._suspended = False
            self._view.close()
            with self._keyboard.returned():
                os.kill(os.getpid(), signal.SIGSTOP)
            self._view.open()

    def _step(self, now_s: float) -> int | None:
        """Run due actions; return the exit code at the end."""
        course = self._course
        self._take_keys(now_s)
        self._take_answers(now_s)
        course.look(now_s)
        self._take_interrupts()
        if course.t_s(now_s) >= self._options.cancel_after:
            self._start_cancelling()
        if self._cancelling:
            course.cancel(now_s)
        elif self._updates and course.t_s(now_s) >= self._updates[0].at_s:
            self._update()
        self._view.tick(course.t_s(now_s))
        return self._verdict(now_s)

    def _verdict(self, now_s: float) -> int | None:
        course = self._course
        if self._interrupts > 1 and course.under_way:
            self.gave_up = True
            course.say("No longer waiting; the goal may still be active.", bad=True)
            return EXIT_ABORTED
        if why := course.why_lost(now_s):
            self.gave_up = True
            course.say(why, bad=True)
            return EXIT_NO_SERVER
        return None if course.under_way or self._goes_on() else self._end()

    def _take_interrupts(self) -> None:
        if self._interrupts and not self._interrupted:
            self._interrupted = True
            if self._cancelling:
                self._course.say("Already cancelling; another Ctrl-C stops waiting")
            self._start_cancelling()

    # --- goals ---------------------------------------------------------------------------

    def _start_cancelling(self) -> None:
        if self._cancelling:
            return
        self._cancelling = True
        if self._course.under_way:
            self._course.say("Cancelling; waiting for the vehicle to stop")

    def _update(self) -> None:
        # One after the other: the order in which the server takes them is the order that counts.
        if not self._course.unanswered:
            self._waiting = False
            update = self._updates.popleft()
            self._course.send(make_point_client_goal(self._options, update.position_m))

    def _goes_on(self) -> bool:
        """True if another goal follows one that has arrived."""
        more = bool(self._updates) and self._course.code == EXIT_SUCCESS and not self._cancelling
        if more and not self._waiting:
            self._waiting = True
            self._course.say(f"The next goal is due at {self._updates[0].at_s:g} s")
        return more

    def _end(self) -> int:
        for update in self._updates:
            x, y, z = update.position_m
            self._course.say(f"Not sent: goal ({x:g}, {y:g}, {z:g}) at {update.at_s:g} s")
        if self._updates and self._course.code == EXIT_SUCCESS:
            return EXIT_CANCELED
        return self._course.exit_code

    # --- keys ----------------------------------------------------------------------------

    def _take_keys(self, now_s: float) -> None:
        if self._keyboard is None:
            return
        for pressed in self._keys.feed(self._keyboard.read()):
            self._obey(pressed, now_s)
        self._view.prompt(f"x y z in {self._options.frame or 'map'}: ", self._keys.typed)

    def _obey(self, pressed: Pressed, now_s: float) -> None:
        if pressed.key is Key.HELP:
            self._course.say(HELP)
        elif pressed.key is Key.CANCEL:
            self._start_cancelling()
        elif pressed.key is Key.GOAL:
            self._send_typed(pressed.line)
        else:
            self._call(pressed.key, now_s)

    def _send_typed(self, line: str) -> None:
        if self._cancelling:
            self._course.say("Not sent: the goal is being cancelled.", bad=True)
            return
        try:
            position_m = parse_point(line)
        except UpdateError as error:
            self._course.say(str(error), bad=True)
            self._keys.typed = line  # to be put right
            return
        if self._chooses_avoidance():
            self._course.say(_AVOIDED)
        self._course.send(make_point_client_goal(self._options, position_m), typed=True)

    def _call(self, key: Key, now_s: float) -> None:
        if self._cancelling:
            self._course.say("The goal is being cancelled.", bad=True)
            return
        service = self._services[key]
        if service.service_is_ready():
            self._calls.append((service.call_async(Trigger.Request()), now_s))
        else:
            self._course.say(f"The server does not offer {key.name.lower()}.", bad=True)

    def _take_answers(self, now_s: float) -> None:
        for call in list(self._calls):
            future, called_s = call
            if future.done():
                answer = future.result()
                self._course.say(self._course.numbered(answer.message), bad=not answer.success)
            elif now_s - called_s > RESPONSE_TIMEOUT_S:
                self._course.say("The server did not answer.", bad=True)
            else:
                continue
            self._calls.remove(call)


def run_goal(options: argparse.Namespace, argv: list[str]) -> int:
    """Send the goal of the command line, show its progress, and return the exit code."""
    client_goal = make_client_goal(options)
    with client_node(argv, options.vehicle) as node:
        with ExitStack() as on_exit:
            # Keys need a terminal for the output.
            people = sys.stdin.isatty() and sys.stdout.isatty() and not options.json
            keyboard = Keyboard(sys.stdin) if people else None
            if keyboard is not None:
                on_exit.callback(keyboard.close)
            view = make_view(plain=options.plain, json=options.json, keys=people)
            on_exit.callback(view.close)
            client = NavigationClient(node, view, client_goal, options, keyboard)
            on_exit.callback(client.close)
            _handle_signals(client, keyboard)
            code = client.run()
        if client.gave_up:
            end_without_server(code)
        return code


def _handle_signals(client: NavigationClient, keyboard: Keyboard | None) -> None:
    def interrupt(_number: int, _frame: FrameType | None) -> None:
        client.interrupt()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)
    if keyboard is not None:
        _handle_keys(client, keyboard)


def _handle_keys(client: NavigationClient, keyboard: Keyboard) -> None:
    """Leave the terminal as it was when its keys stop or suspend the client."""

    def quit_at_once(number: int, _frame: FrameType | None) -> None:
        keyboard.close()
        os.write(sys.stdout.fileno(), _SHOW_CURSOR)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def suspend(_number: int, _frame: FrameType | None) -> None:
        client.suspend()

    signal.signal(signal.SIGQUIT, quit_at_once)
    signal.signal(signal.SIGTSTP, suspend)
