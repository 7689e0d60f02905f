"""Targets that a camera reports over MAVLink: ``ros2 run drone_navigation navigation_target``."""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import math
import select
import sys
import time

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions

from drone_navigation.process_control.ros_arguments import own_arguments
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import StopSignals
from flight_logs.command_version import add_version
from mavlink_vehicle.codec import Codec, mavlink
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links import Link, open_link

EXIT_OK = 0
EXIT_USAGE = 2
DEFAULT_LINK = "udpin://127.0.0.1:14560"
_LANDING_TARGET = mavlink.MAVLink_landing_target_message
# Of a picture that is older the stamp is in another time, as that since the camera was started.
_AGE_MAX_S = 10.0
_WAIT_S = 0.2
_SYSTEM_ID, _COMPONENT_ID = 1, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
_SYSTEM_ID_MAX = 255


def make_parser() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(
        prog="navigation_target",
        description="Publish the target that a camera, or a simulated one (python -m mavlink_sitl "
        "--mark NORTH,EAST), reports as LANDING_TARGET, for navigation_client land --on.",
    )
    add_version(parser, "drone_navigation")
    parser.add_argument(
        "--link",
        default=DEFAULT_LINK,
        metavar="URL",
        help=f"link of the camera, as those of vehicles (default: {DEFAULT_LINK})",
    )
    parser.add_argument("--topic", default="/target", help="topic of the poses (default: /target)")
    parser.add_argument(
        "--frame",
        default="base_link",
        help="frame of the vehicle that carries the camera (default: base_link)",
    )
    parser.add_argument(
        "--system",
        type=_system,
        default=0,
        metavar="ID",
        help="hear only the camera of the vehicle with this MAVLink system id (default: all)",
    )
    return parser


def _system(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= _SYSTEM_ID_MAX:
        raise argparse.ArgumentTypeError(
            f"a MAVLink system id is 1 to {_SYSTEM_ID_MAX}, not {text!r}"
        )
    return int(text)


def target_pose(
    message: mavlink.MAVLink_landing_target_message, frame: str, now_ns: int
) -> PoseStamped | None:
    """Return the pose of a target along the axes of the vehicle; None if it has no position.

    Args:
        message: with a position in MAV_FRAME_BODY_FRD.
        frame: of the vehicle.
        now_ns: time of ROS, nanoseconds; the stamp, where that of the message is in another time.
    """
    place = (message.x, -message.y, -message.z)
    is_usable = message.position_valid and message.frame == mavlink.MAV_FRAME_BODY_FRD
    if not is_usable or not all(map(math.isfinite, place)):
        return None
    pose = PoseStamped()
    pose.header.frame_id = frame
    measured_ns = 1000 * message.time_usec
    if not 0 <= now_ns - measured_ns <= _AGE_MAX_S * 1e9:
        measured_ns = now_ns
    pose.header.stamp = Time(sec=measured_ns // 10**9, nanosec=measured_ns % 10**9)
    pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = place
    # All zeros: its orientation is not known.
    pose.pose.orientation.w = 0.0
    return pose


def main(args: list[str] | None = None) -> int:
    """Publish until a signal; return the exit code."""
    return run_program("navigation_target", args, _main, EXIT_OK)


def _main(argv: list[str]) -> int:
    parser = make_parser()
    options = parser.parse_args(own_arguments(argv))
    try:
        link = open_link(options.link)
    except LinkError as error:
        parser.error(str(error))
    signals = StopSignals("navigation_target")
    try:
        with starting_ros():
            rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
            node = Node("navigation_target")
        poses = node.create_publisher(PoseStamped, options.topic, 10)
        print(f"Publishes on {poses.topic_name} what comes on {link.description}.", flush=True)
        _relay(signals, link, poses, node, options)
    except InvalidTopicNameException as error:
        parser.error(f"{options.topic!r} is no name of a topic: {str(error).splitlines()[0]}")
    finally:
        link.close()
        rclpy.try_shutdown()
    signals.finish(EXIT_OK)
    return EXIT_OK


def _relay(
    signals: StopSignals,
    link: Link,
    poses: Publisher[PoseStamped],
    node: Node,
    options: argparse.Namespace,
) -> None:
    """Publish what comes, until a request to stop."""
    codec = Codec(_SYSTEM_ID, _COMPONENT_ID)
    clock, is_reported = node.get_clock(), False
    while not signals.is_requested:
        link.poll(time.monotonic())
        files = link.filenos()
        if not files:
            signals.wait(_WAIT_S)
            continue
        select.select(files, (), (), _WAIT_S)
        for data, _ in link.receive():
            for message in codec.decode(data):
                if not isinstance(message, _LANDING_TARGET) or (
                    options.system and message.get_srcSystem() != options.system
                ):
                    continue
                pose = target_pose(message, options.frame, clock.now().nanoseconds)
                if pose is not None:
                    poses.publish(pose)
                elif not is_reported:
                    is_reported = True
                    print(
                        "A LANDING_TARGET without a position in MAV_FRAME_BODY_FRD is not used.",
                        flush=True,
                    )


if __name__ == "__main__":
    sys.exit(main())
