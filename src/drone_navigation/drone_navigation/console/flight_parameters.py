"""Parameters of a server and of its vehicle that decide a flight. One thread only."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters

from custom_interfaces.srv import GetVehicleParameters
from drone_navigation.console.requests import VehicleRequests
from navigation_bridge.configuration.settings import SWITCH
from navigation_core.tasks.traffic.volumes import Separation

__all__ = ["FlightParameters"]

_AGAIN_S = 1.0
_SEPARATION = ("separation", "separation_horizontal_m", "separation_vertical_m")
_VALUES = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
}


class FlightParameters:
    """Asks for them when they are looked at, and keeps the answers.

    Attributes:
        separation: what the server has its vehicles keep; None while that is unknown.
        is_separated: whether it has them wait for each other; None while that is unknown.
    """

    def __init__(self, requests: VehicleRequests) -> None:
        """Know nothing.

        Args:
            requests: of the vehicle.
        """
        self._requests = requests
        self._asked_s = -math.inf
        self._server: dict[str, object] = {}
        self._parameters: dict[str, float] = {}
        self._wind: list[float] | None = None
        self.separation: Separation | None = None
        self.is_separated: bool | None = None
        self._is_own = False

    @property
    def server_is_known(self) -> bool:
        """Whether the server's own are known."""
        return bool(self._server)

    @property
    def vehicle_is_known(self) -> bool:
        """Whether some of the vehicle's are known, which may lack others."""
        return bool(self._parameters)

    def forget(self) -> None:
        """Know nothing: the server is another one."""
        self._asked_s = -math.inf
        self._server, self._parameters, self._wind = {}, {}, None
        self.separation = self.is_separated = None
        self._is_own = False

    def values(self) -> dict[str, object]:
        """Return the members of an order for the rehearsal: `server`, `parameters`, `wind`."""
        return {
            "server": dict(self._server),
            "parameters": dict(self._parameters),
            "wind": self._wind,
        }

    def look(self, server: Sequence[str], vehicle: Sequence[str], now: float) -> None:
        """Ask for the values of these names, at most once a second, at a time in s."""
        if now < self._asked_s + _AGAIN_S or not server:
            return
        self._asked_s = now

        def take_server(answer: GetParameters.Response) -> None:
            pairs = zip(server, answer.values, strict=False)
            self._server = {n: getattr(v, _VALUES[v.type]) for n, v in pairs if v.type in _VALUES}

        def take_vehicle(answer: GetVehicleParameters.Response) -> None:
            pairs = zip(vehicle, answer.values, strict=False)
            self._parameters = {name: value for name, value in pairs if math.isfinite(value)}
            wind = [answer.wind.x, answer.wind.y, answer.wind.z]
            self._wind = wind if all(map(math.isfinite, wind)) else None

        request = GetParameters.Request(names=list(server))
        self._requests.ask(GetParameters, "get_parameters", request, take_server)
        asked = GetVehicleParameters.Request(names=list(vehicle))
        self._requests.ask(GetVehicleParameters, "get_vehicle_parameters", asked, take_vehicle)
        self._look_for_separation()

    def _look_for_separation(self) -> None:
        """Ask the vehicle's own node, and that of a server of several vehicles."""

        def take(of_server: bool, answer: GetParameters.Response) -> None:
            # A node that does not have all of them returns none.
            if len(answer.values) == len(_SEPARATION) and not (of_server and self._is_own):
                self._is_own = not of_server
                switch, horizontal, vertical = answer.values
                self.is_separated = SWITCH[switch.string_value]
                self.separation = Separation(horizontal.double_value, vertical.double_value)

        request = GetParameters.Request(names=list(_SEPARATION))
        for of_server in (False, True):
            done = partial(take, of_server)
            self._requests.ask(GetParameters, "get_parameters", request, done, of_server)
