"""Services of the navigation server: pause, resume, hold, arm, disarm, and so on."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger

from custom_interfaces.srv import GetVehicleParameters, SetMode
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.waiting import STOPPED, Waiting
from mavlink_vehicle.errors import DriverError
from navigation_bridge.clients.client_services import ClientServices
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.goal import ServiceDone
from navigation_core.geometry import Vector3

ServiceRequest: TypeAlias = Trigger.Request | SetMode.Request
ServiceResponse: TypeAlias = Trigger.Response | SetMode.Response

_CALL_TIMEOUT_S = 2.0
# Longer than a mode change and an arming may take (``VehicleConfig.operation_timeout_s`` each).
_DONE_TIMEOUT_S = 25.0


class ServiceServers:
    """Offers the services below the node's name: ``~/pause``, ``~/hold`` and so on."""

    def __init__(self, access: BridgeAccess) -> None:
        """Offer the services: most are std_srvs/Trigger."""
        node, bridge = access.node, access.bridge
        self._bridge, self._driver, self._clock = bridge, access.driver, access.clock
        self._closed = access.is_closed
        self._numbers = itertools.count(1)
        self._waiting: dict[int, Waiting[ServiceDone]] = {}
        group = ReentrantCallbackGroup()
        callbacks: dict[str, Callable[[Trigger.Request, Trigger.Response], Trigger.Response]] = {
            "pause": partial(self._ask, ClientServices.pause),
            "resume": partial(self._ask, ClientServices.resume),
        }
        callbacks |= {
            service.value: partial(self._serve, service)
            for service in Service
            if service is not Service.SET_MODE
        }
        self._servers = [
            node.create_service(Trigger, f"~/{name}", callback, callback_group=group)
            for name, callback in callbacks.items()
        ]
        self._servers.append(
            node.create_service(
                SetMode,
                f"~/{Service.SET_MODE.value}",
                partial(self._serve, Service.SET_MODE),
                callback_group=group,
            )
        )

        self._servers.append(
            node.create_service(
                GetVehicleParameters,
                "~/get_vehicle_parameters",
                self._read_parameters,
                callback_group=group,
            )
        )

    # --- executor threads --------------------------------------------------------------

    def _ask(
        self,
        question: Callable[[ClientServices, float], tuple[bool, str]],
        _request: Trigger.Request,
        response: Trigger.Response,
    ) -> Trigger.Response:
        try:
            response.success, response.message = self._driver.call(
                lambda: question(self._bridge.services, self._clock.now()), _CALL_TIMEOUT_S
            )
        except DriverError as error:
            response.success, response.message = False, str(error)
        return response

    def _serve(
        self, service: Service, request: ServiceRequest, response: ServiceResponse
    ) -> ServiceResponse:
        number = next(self._numbers)
        mode = request.mode if service is Service.SET_MODE else ""
        waiting = self._waiting[number] = Waiting()
        try:
            self._driver.post(
                lambda: self._bridge.services.serve(number, service, self._clock.now(), mode)
            )
            answer = waiting.wait(_DONE_TIMEOUT_S, self._closed)
        finally:
            del self._waiting[number]
        if answer is None:
            response.success = False
            text = f"No answer from the vehicle within {_DONE_TIMEOUT_S:g} s."
            response.message = STOPPED if self._closed() else text
        else:
            response.success, response.message = answer.success, answer.message
        return response

    def _read_parameters(
        self, request: GetVehicleParameters.Request, response: GetVehicleParameters.Response
    ) -> GetVehicleParameters.Response:
        def read() -> tuple[list[float], Vector3 | None]:
            values = self._bridge.services.read_parameters(request.names, self._clock.now())
            return values, self._bridge.vehicle.state.wind_ned_m_s

        wind = None
        try:
            response.values, wind = self._driver.call(read, _CALL_TIMEOUT_S)
        except (DriverError, ValueError):
            response.values = [math.nan] * len(request.names)
        north, east, down = wind or (math.nan, math.nan, math.nan)
        response.wind.x, response.wind.y, response.wind.z = east, north, -down
        return response

    # --- driver thread -----------------------------------------------------------------

    def finish(self, answer: ServiceDone) -> None:
        """Pass the answer to the waiting service callback."""
        waiting = self._waiting.get(answer.number)
        if waiting is not None:
            waiting.take(answer)
