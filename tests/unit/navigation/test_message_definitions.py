"""A bag's definitions are enough to read its messages without ROS."""

from __future__ import annotations

import random
import re
from importlib import import_module
from typing import Any

import pytest
from action_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from mcap.records import Schema
from nav_msgs.msg import Odometry, Path
from rclpy.serialization import serialize_message
from sensor_msgs.msg import BatteryState, NavSatFix
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from custom_interfaces.msg import GoalEvent, VehicleStatus
from drone_navigation.bag.message_definitions import (
    ENCODING,
    DefinitionError,
    definition,
    type_name,
)
from drone_navigation.server.actions import ACTIONS
from tests.support.logs.bags import Decoders, plain

FEEDBACKS = [kind.type.Impl.FeedbackMessage for kind in ACTIONS]
TYPES = [
    BatteryState, DiagnosticArray, GoalEvent, GoalStatusArray, MarkerArray, NavSatFix, Odometry,
    Path, PoseStamped, String, VehicleStatus, *FEEDBACKS,
]  # fmt: skip


def fill(message: Any, source: random.Random) -> Any:
    """Give every field a value; numbers are such that a float32 holds them."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        listed = re.fullmatch(r"sequence<(\w+)/(\w+)>", kind)
        if listed:
            item = getattr(import_module(f"{listed[1]}.msg"), listed[2])
            setattr(message, name, [fill(item(), source), fill(item(), source)])
        elif hasattr(value, "get_fields_and_field_types"):
            fill(value, source)
        elif kind == "sequence<float>":
            setattr(message, name, [1.5, -2.25])
        elif re.search(r"\[\d+\]", kind):
            value[:] = [source.randrange(100) for _ in value]
        elif isinstance(value, (bool, float, int, str)):
            setattr(message, name, type(value)(source.randrange(1, 100)))
        elif isinstance(value, bytes):
            setattr(message, name, bytes([source.randrange(100)]))
    return message


@pytest.mark.parametrize("message_type", TYPES, ids=lambda kind: kind.__name__)
def test_messages_serialized_by_ros_are_decoded_from_the_definition_alone(
    message_type: Any,
) -> None:
    message = fill(message_type(), random.Random(1))
    schema = Schema(1, definition(message_type).encode(), ENCODING, type_name(message_type))
    decode = Decoders().decoder_for("cdr", schema)
    assert decode is not None
    assert plain(decode(serialize_message(message))) == plain(message)


def test_a_definition_has_the_form_that_tools_of_ros_write() -> None:
    text = definition(PoseStamped)
    assert type_name(PoseStamped) == "geometry_msgs/msg/PoseStamped"
    names = ["std_msgs/Header", "geometry_msgs/Pose", "builtin_interfaces/Time",
             "geometry_msgs/Point", "geometry_msgs/Quaternion"]  # fmt: skip
    assert re.findall(r"^={80}\nMSG: (\S+)$", text, re.MULTILINE) == names
    assert text.startswith("# A Pose with reference coordinate frame and timestamp")


def test_an_actions_feedback_is_defined_with_its_goals_id() -> None:
    feedback = FEEDBACKS[0]
    assert type_name(feedback) == "custom_interfaces/action/Navigate_FeedbackMessage"
    text = definition(feedback)
    assert text.startswith(
        "unique_identifier_msgs/UUID goal_id\ncustom_interfaces/Navigate_Feedback feedback\n"
    )
    assert "MSG: unique_identifier_msgs/UUID\n" in text


def test_a_type_that_is_not_installed_is_named() -> None:
    class Unknown:
        __module__ = "no_such_msgs.msg._unknown"

    with pytest.raises(DefinitionError, match="package no_such_msgs is not installed"):
        definition(Unknown)
    Unknown.__module__ = "std_msgs.msg._unknown"
    definition.cache_clear()
    with pytest.raises(DefinitionError, match="No definition of std_msgs/Unknown is installed"):
        definition(Unknown)
