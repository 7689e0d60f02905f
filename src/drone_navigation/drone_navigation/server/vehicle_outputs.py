"""The front of a bridge: its outputs routed to ROS and the recorder."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import LoggingSeverity
from rclpy.node import Node

from drone_navigation.server.actions import GoalServers
from drone_navigation.server.publishing.topics import Topics
from drone_navigation.server.service_servers import ServiceServers
from mavlink_vehicle.codec import Codec, Message, with_source
from mavlink_vehicle.io.tlog import TlogWriter
from navigation_bridge import notes
from navigation_bridge.bridge import Bridge, Front
from navigation_bridge.goals import goal as outputs
from navigation_bridge.goals.goal import LogLevel, LogLine, Output
from navigation_bridge.recording.noted_outputs import NotedOutputs
from navigation_core.outcomes import OutcomeCode

_SEVERITIES = {LogLevel.ERROR: LoggingSeverity.ERROR, LogLevel.WARN: LoggingSeverity.WARN}


class VehicleOutputs(Front):
    """Sinks of the outputs of one vehicle's bridge."""

    def __init__(self, bridge: Bridge, recorder: TlogWriter | None = None) -> None:
        """Become the bridge's front; :meth:`attach` must follow before the driver starts."""
        bridge.front = self
        self._bridge = bridge
        self._notes = Codec(source_system=1, source_component=notes.COMPONENT_ID)
        self._noted = NotedOutputs(bridge)
        self._server: GoalServers | None = None
        self._topics: Topics | None = None
        self._node: Node | None = None
        self._sinks: dict[type[Output], Callable[[Any], object]] = {}
        self._muted = False
        self._plan = outputs.PlanChanged(())
        self._recorded = recorder is not None
        if recorder is not None:
            self._sinks[outputs.Annotation] = partial(self._record, recorder)

    def attach(
        self, node: Node, server: GoalServers, services: ServiceServers, topics: Topics
    ) -> None:
        """Set the sinks of the outputs."""
        self._node, self._server = node, server
        self._sinks |= {
            outputs.GoalFeedback: server.publish_feedback,
            outputs.GoalFinished: server.finish,
            outputs.CancelWanted: server.cancel,
            outputs.ServiceDone: services.finish,
            LogLine: partial(_log, node.get_logger().name),
        }
        self.attach_topics(topics)

    def attach_topics(self, topics: Topics) -> None:
        """Set the sink of what is published."""
        self._topics = topics
        self._sinks |= {
            outputs.GoalRejected: topics.publish_rejection,
            outputs.GoalHappened: topics.publish_event,
            outputs.PlanChanged: topics.publish_plan,
        }

    def take_note(self, message: Message, now: float) -> None:
        """Publish again what a server wrote into the recording that is played."""
        system_id = self._bridge.vehicle.state.system_id
        if system_id in (0, None, message.get_srcSystem()):
            for output in self._noted.take(message, now):
                self._put_out(output)

    def begin_again(self) -> None:
        """Reset: the recording is played from its start."""
        self._bridge.begin_again()
        self._noted = NotedOutputs(self._bridge)
        if self._plan.path_enu_m:
            self._put_out(outputs.PlanChanged(()))
        if self._topics is not None:
            self._topics.begin_again()

    def mute(self, muted: bool, now: float) -> None:
        """Publish nothing of the recording for a while; afterwards, everything as it then is."""
        self._muted = muted
        if not muted:
            self._put_out(self._plan)
            if self._topics is not None:
                self._topics.begin_again()
            self.update(now)

    def put_out(self) -> None:
        """Publish the outputs."""
        while (output := self._bridge.next_output(self._recorded)) is not None:
            self._put_out(output)

    def update(self, now: float) -> None:
        """Publish the outputs, and the topics."""
        self.put_out()
        if self._topics is not None and not self._muted:
            self._topics.update(now)

    def next_deadline(self) -> float | None:
        """Return the deadline of the topics."""
        return None if self._topics is None or self._muted else self._topics.next_deadline()

    def fail(self, error: Exception) -> None:
        """Log an internal error with its traceback."""
        text = "".join(traceback.format_exception(type(error), error, error.__traceback__))
        if self._node is not None:
            self._node.get_logger().error(f"Internal error: {text}")

    def give_up(self, error: Exception) -> None:
        """End all goals without the bridge, which is not called again."""
        if self._node is not None:
            self._node.get_logger().fatal(str(error))
        if self._server is not None:
            self._server.abandon(OutcomeCode.INTERNAL_ERROR, str(error))

    def _put_out(self, output: Output) -> None:
        if isinstance(output, outputs.PlanChanged):
            self._plan = output
        # A client waits for an answer, also while a recording is played.
        if self._muted and not isinstance(output, outputs.ServiceDone):
            return
        sink = self._sinks.get(type(output))
        if sink is not None:
            sink(output)

    def _record(self, recorder: TlogWriter, note: outputs.Annotation) -> None:
        system_id = self._bridge.vehicle.state.system_id or 1
        message = with_source(note.message, system_id, notes.COMPONENT_ID)
        recorder.write(self._notes.encode(message))


def _log(logger: str, line: LogLine) -> None:
    """Log a line; rclpy's own method first searches for its caller, for milliseconds."""
    severity = _SEVERITIES.get(line.level, LoggingSeverity.INFO)
    rclpy_implementation.rclpy_logging_rcutils_log(severity, logger, line.text, "", "", 0)
