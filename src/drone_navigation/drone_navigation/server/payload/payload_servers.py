"""The action `point_gimbal`, `~/trigger_camera`, `~/gimbal_state` and `~/image_captured`."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger

from custom_interfaces.action import PointGimbal
from custom_interfaces.msg import GimbalState, GoalCode, ImageCaptured
from drone_navigation.qos import RESULT_TIMEOUT_S, STREAM_QOS
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.waiting import Waiting
from mavlink_vehicle.events import PhotoReported
from navigation_bridge.names import POINT_GIMBAL_ACTION_NAME
from navigation_bridge.requests.payload_requests import (
    GimbalMode,
    GimbalReport,
    PayloadDone,
    PayloadRequests,
    PointGimbalRequest,
    TakeDone,
)
from navigation_core.outcomes import OutcomeCode

__all__ = ["PayloadServers"]

_LOOK_S = 0.1
# The vehicle's answer; each command is given up sooner.
_ANSWER_S = 45.0
# A gimbal turns at 20 degrees a second, or faster.
_TURN_S = 20.0
_SILENCE_S = 5.0

Request = Callable[[PayloadRequests, TakeDone, float], object]


class PayloadServers:
    """Offers them; a callback waits in its own thread of the executor."""

    def __init__(self, access: BridgeAccess) -> None:
        """Offer them."""
        node = self._node = access.node
        self._bridge, self._driver, self._clock = access.bridge, access.driver, access.clock
        self._closed = access.is_closed
        self._pause = threading.Event()  # never set
        self._gimbal_state = node.create_publisher(GimbalState, "~/gimbal_state", STREAM_QOS)
        self._image_captured = node.create_publisher(ImageCaptured, "~/image_captured", STREAM_QOS)
        group = ReentrantCallbackGroup()
        node.create_service(Trigger, "~/trigger_camera", self._trigger, callback_group=group)
        self._action = ActionServer(
            node,
            PointGimbal,
            POINT_GIMBAL_ACTION_NAME,
            execute_callback=self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group,
            result_timeout=RESULT_TIMEOUT_S,
        )
        payload = access.bridge.feature(PayloadRequests)
        payload.on_gimbal, payload.on_photo = self._publish_gimbal, self._publish_photo

    # --- the driver's thread -------------------------------------------------------------

    def _publish_gimbal(self, report: GimbalReport) -> None:
        self._gimbal_state.publish(
            GimbalState(
                stamp=self._node.get_clock().now().to_msg(),
                pitch=report.pitch_rad,
                yaw=report.yaw_rad,
                yaw_locked=report.yaw_locked,
                control_system=report.control[0],
                control_component=report.control[1],
            )
        )

    def _publish_photo(self, photo: PhotoReported) -> None:
        latitude, longitude, altitude = photo.place
        self._image_captured.publish(
            ImageCaptured(
                stamp=self._node.get_clock().now().to_msg(),
                index=photo.index,
                success=photo.success,
                latitude=latitude,
                longitude=longitude,
                altitude=altitude,
            )
        )

    # --- executor threads ----------------------------------------------------------------

    def _trigger(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        done = self._ask(PayloadRequests.take_photo, lambda: False)
        response.success = done.code is OutcomeCode.SUCCESS
        response.message = f"{done.code.value}: {done.message}"
        return response

    def _execute(self, handle: ServerGoalHandle) -> PointGimbal.Result:
        request = _request(handle.request)
        done = self._ask(
            lambda requests, take, now: requests.point(request, take, now),
            lambda: handle.is_cancel_requested,
        )
        if done.code is OutcomeCode.SUCCESS:
            done = self._wait_until_there(handle, request)
        result = PointGimbal.Result()
        result.error_code = getattr(GoalCode, done.code.value)
        result.message = f"{done.code.value}: {done.message}"
        result.success = done.code is OutcomeCode.SUCCESS
        if result.success:
            handle.succeed()
        elif done.code is OutcomeCode.CANCELED:
            handle.canceled()
        else:
            handle.abort()
        self._node.get_logger().info(f"Gimbal goal ended: {result.message}")
        return result

    def _wait_until_there(
        self, handle: ServerGoalHandle, request: PointGimbalRequest
    ) -> PayloadDone:
        """Give feedback until the gimbal reports what was asked for."""
        began_s = time.monotonic()
        while (elapsed_s := time.monotonic() - began_s) < _TURN_S:
            if self._closed():
                return _STOPPED
            if handle.is_cancel_requested:
                return _CANCELED
            there, report = self._look(request)
            handle.publish_feedback(_feedback(report))
            if there:
                return PayloadDone(OutcomeCode.SUCCESS, "The gimbal points there.")
            if report is None and elapsed_s > _SILENCE_S:
                text = "The vehicle accepted it; its gimbal does not report where it points."
                return PayloadDone(OutcomeCode.SUCCESS, text)
            self._pause.wait(_LOOK_S)
        return PayloadDone(
            OutcomeCode.TIMEOUT, f"The gimbal did not point there within {_TURN_S:g} s."
        )

    def _look(self, request: PointGimbalRequest) -> tuple[bool | None, GimbalReport | None]:
        waiting: Waiting[tuple[bool | None, GimbalReport | None]] = Waiting()

        def look() -> None:
            payload = self._bridge.feature(PayloadRequests)
            waiting.take((payload.is_there(request, self._clock.now()), payload.gimbal))

        self._driver.post(look)
        return waiting.wait(_ANSWER_S, self._closed) or (None, None)

    def _ask(self, request: Request, is_canceled: Callable[[], bool]) -> PayloadDone:
        """Request something of the bridge, and wait for its end."""
        waiting: Waiting[PayloadDone] = Waiting()
        self._driver.post(
            lambda: request(self._bridge.feature(PayloadRequests), waiting.take, self._clock.now())
        )
        done = waiting.wait(_ANSWER_S, lambda: self._closed() or is_canceled())
        if done is not None:
            return done
        if self._closed():
            return _STOPPED
        if is_canceled():
            return _CANCELED
        return PayloadDone(OutcomeCode.INTERNAL_ERROR, "The driver thread does not respond.")


_STOPPED = PayloadDone(OutcomeCode.SHUTTING_DOWN, "The navigation server was stopped.")
_CANCELED = PayloadDone(OutcomeCode.CANCELED, "The goal was cancelled.")


def _request(goal: PointGimbal.Goal) -> PointGimbalRequest:
    modes = [mode for mode in GimbalMode if mode.value == goal.mode]
    point = goal.target.point
    return PointGimbalRequest(
        mode=modes[0] if modes else None,
        pitch_rad=goal.pitch,
        yaw_rad=goal.yaw,
        yaw_locked=goal.yaw_locked,
        frame_id=goal.target.header.frame_id,
        target=(point.x, point.y, point.z),
        system_id=goal.system_id,
    )


def _feedback(report: GimbalReport | None) -> PointGimbal.Feedback:
    if report is None:
        return PointGimbal.Feedback(pitch=math.nan, yaw=math.nan)
    return PointGimbal.Feedback(
        pitch=report.pitch_rad, yaw=report.yaw_rad, yaw_locked=report.yaw_locked
    )
