"""``ros2`` for a ROS without it, such as that of wheels: the commands that people type most.

Where the environment has ros2cli, that is run. Output is as of ros2cli (Jazzy). Exit codes: 0 done,
1 an error, a rejected goal or value, 2 invalid command line, 130 ended by Ctrl-C.
"""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import importlib
import importlib.util
import os
import sys
from collections.abc import Callable

from rclpy.action.graph import get_action_names_and_types
from rclpy.node import Node

from drone_navigation.ros2 import actions, installed, nodes, parameters, services, topics
from drone_navigation.ros2.session import CommandError, Interrupted, list_of, session
from flight_logs.command_version import add_version

__all__ = ["main", "make_parser"]

EXIT_OK, EXIT_ERROR, EXIT_USAGE, EXIT_INTERRUPTED = 0, 1, 2, 130
_ABOUT = (
    "The commands of ros2 that people type most, for a ROS without ros2cli; launch, bag, doctor "
    "and the rest need a full ROS 2 installation."
)
_Arguments = dict[str, dict[str, object]]
_NAME: _Arguments = {"name": {}}
_NODE: _Arguments = {"node": {}}
_SETTING: _Arguments = {"parameter": {}, "value": {}}
_NUMBER: _Arguments = {"-c --count": {"action": "store_true", "help": "only their number"}}
_TYPED: _Arguments = {"-t --show-types": {"action": "store_true", "help": "with the types"}}
_LIST = _TYPED | _NUMBER
_HIDDEN: _Arguments = {
    "-a --all --include-hidden --include-hidden-topics --include-hidden-services": {
        "action": "store_true",
        "help": "hidden ones, too",
    },
}
_VALUES: _Arguments = {"name": {}, "type": {}, "values": {"nargs": "?", "default": "{}"}}


def _rate(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"a rate in Hz is above 0, not {text}")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"a number of messages is at least 1, not {text}")
    return value


_COMMANDS: dict[str, dict[str, tuple[Callable[..., int], str, _Arguments]]] = {
    "action": {
        "list": (list_of(get_action_names_and_types), "print all actions", _LIST),
        "info": (actions.info, "print clients and servers of an action", _NAME | _LIST),
        "send_goal": (actions.send_goal, "send a goal; Ctrl-C cancels it", _VALUES | {
            "-f --feedback": {"action": "store_true", "help": "print the feedback, too"},
        }),
    },
    "topic": {
        "list": (list_of(Node.get_topic_names_and_types), "print all topics", _LIST | _HIDDEN),
        "info": (topics.info, "print type, publishers and subscriptions", _NAME | {
            "-v --verbose": {"action": "store_true", "help": "with nodes and QoS"},
        }),
        "echo": (topics.echo, "print the messages of a topic", _NAME | {
            "type": {"nargs": "?"},
            "--once": {"action": "store_true", "help": "only the first one"},
            "--field": {"help": "only this field, such as pose.position"},
            "--full-length": {"action": "store_true", "help": "do not cut long arrays"},
        }),
        "hz": (topics.hz, "print the rate of a topic", _NAME | {
            "-w --window": {"type": _count, "default": 10_000, "help": "messages to average over"},
        }),
        "pub": (topics.pub, "publish a message again and again", _VALUES | {
            "-1 --once": {"action": "store_true", "help": "once, when somebody listens"},
            "-t --times": {"type": _count, "default": 0, "help": "how often (default: no end)"},
            "-r --rate": {"type": _rate, "default": 1.0, "help": "in Hz (default 1)"},
        }),
    },
    "param": {
        "list": (parameters.list_parameters, "print all parameters", {"node": {"nargs": "?"}}),
        "get": (parameters.get, "print the value of a parameter", _NODE | {
            "parameter": {}, "--hide-type": {"action": "store_true", "help": "only the value"},
        }),
        "set": (parameters.set_parameter, "set a parameter", _NODE | _SETTING),
        "describe": (parameters.describe, "print type and limits of parameters", _NODE | {
            "parameters": {"nargs": "+"},
        }),
    },
    "node": {
        "list": (nodes.list_nodes, "print all nodes", _HIDDEN | _NUMBER),
        "info": (nodes.info, "print what a node publishes and serves", _NODE | _HIDDEN),
    },
    "service": {
        "list": (list_of(Node.get_service_names_and_types), "print all services", _LIST | _HIDDEN),
        "call": (services.call, "call a service", _VALUES),
    },
    "interface": {
        "list": (installed.list_interfaces, "print all interfaces", {}),
        "show": (installed.show_interface, "print the definition of an interface", {
            "type": {},
            "--all-comments": {"action": "store_true", "help": "also of the messages in it"},
            "--no-comments": {"action": "store_true", "help": "none"},
        }),
    },
    "pkg": {"list": (installed.list_packages, "print all packages", {})},
}  # fmt: skip
_WITHOUT_NODE = {getattr(installed, name) for name in installed.__all__}


def make_parser() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(prog="ros2", description=_ABOUT)
    add_version(parser, "drone_navigation")
    kinds = parser.add_subparsers(metavar="COMMAND")
    for kind, verbs in _COMMANDS.items():
        of_kind = kinds.add_parser(kind, help=", ".join(verbs))
        of_kind_verbs = of_kind.add_subparsers(metavar="VERB", required=True)
        for verb, (command, what, arguments) in verbs.items():
            own = of_kind_verbs.add_parser(verb, help=what, description=f"{what}.".capitalize())
            own.set_defaults(command=command)
            for names, how in arguments.items():
                own.add_argument(*names.split(), **how)  # type: ignore[arg-type]
    run = kinds.add_parser("run", help="run an executable of a package")
    run.set_defaults(command=installed.run)
    run.add_argument("package")
    run.add_argument("executable")
    run.add_argument("arguments", nargs=argparse.REMAINDER)
    return parser


def main(args: list[str] | None = None) -> int:
    """Run a command; return its exit code."""
    return run_program("ros2", args, _main, EXIT_INTERRUPTED)


def _main(argv: list[str]) -> int:
    words = argv[1:]
    if importlib.util.find_spec("ros2cli") is not None:
        sys.argv[0] = "ros2"
        real = importlib.import_module("ros2cli.cli")
        sys.exit(real.main(argv=words))  # a code, or what is wrong
    if not words:
        make_parser().print_help()
        return EXIT_OK
    if not words[0].startswith("-") and words[0] not in (*_COMMANDS, "run"):
        print(f"ros2 {words[0]} needs a full ROS 2 installation; here are {', '.join(_COMMANDS)} "
              "and run.", file=sys.stderr)  # fmt: skip
        return EXIT_USAGE
    options = make_parser().parse_args(words)
    # Each line is printed at once, also into a pipe.
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    try:
        if options.command in _WITHOUT_NODE:
            return int(options.command(options))
        with session() as made:
            return int(options.command(made, options))
    except CommandError as error:
        print(error, file=sys.stderr)
        return EXIT_ERROR
    except Interrupted:
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # `| head` has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
