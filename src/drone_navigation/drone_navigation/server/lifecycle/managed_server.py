"""A server with the life cycle of a managed node (lifecycle_msgs, design.ros2.org).

Unconfigured it has parameters only. Inactive it listens to its vehicles and publishes, and rejects
goals. Active it flies. Each transition can be asked for by the services of a managed node; by
default the server configures and activates itself.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter

from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.server.lateness.lateness_trace import LatenessTrace
from drone_navigation.server.parameters import declare_parameters
from drone_navigation.server.server import NavigationServer
from drone_navigation.server.spinning import Spinner
from mavlink_vehicle.errors import DriverError, LinkError
from mavlink_vehicle.io.clock import Clock
from navigation_bridge.configuration.make_config import ConfigurationError
from navigation_bridge.names import SERVER_NODE_NAME

# A server that finds another one of its name this soon after it was configured is the one too many.
_NEW_S = 5.0
_SPINNER_S = 0.4
_KINDS = ("publishers", "subscriptions", "clients", "services", "timers", "guards", "waitables")


class ManagedServer:
    """The server's node, and the server behind it while it is configured.

    Attributes:
        node: the ROS node.
        exit_wanted: set by the transition to the finalized state.
    """

    def __init__(
        self,
        given: list[Parameter],
        argv: list[str],
        simulator: bool,
        clock: Clock,
        trace: LatenessTrace | None = None,
    ) -> None:
        """Create the node, unconfigured.

        Args:
            given: parameters that the command line sets for every vehicle.
            argv: the command line, for the vehicles' nodes.
            simulator: nothing but single parameters was configured.
            clock: the time of all vehicles.
            trace: times the turns of the driver.
        """
        self._trace = trace
        self._given, self._argv, self._clock = given, argv, clock
        self.node = _ManagedNode(given, self)
        self.exit_wanted = threading.Event()
        self._server: NavigationServer | None = None
        self._made = ExitStack()
        self._entities = _Entities(self.node)
        self._lock = threading.Lock()
        self._configured_s, self._resumed = 0.0, False
        self._spinner = Spinner(self.node)
        self._simulator = simulator

    def start(self) -> bool:
        """Answer requests; first configure and activate, unless ``autostart`` is false.

        Returns:
            False if the server cannot run; the reason is logged.
        """
        try:
            values = declare_parameters(self.node, self._simulator)
        except ConfigurationError as error:
            self.node.get_logger().fatal(str(error))
            return False
        if values["autostart"]:
            success = TransitionCallbackReturn.SUCCESS
            if self.node.trigger_configure() != success or self.node.trigger_activate() != success:
                return False
        else:
            self.node.get_logger().info(
                "Navigation server waits to be configured and activated (~/change_state)"
            )
        self._spinner.start()
        return True

    def look(self) -> str:
        """Look after links and other servers, periodically; return why this one must end, or ''."""
        with self._lock:
            server = self._server
            if server is None:
                return ""
            is_new = self._clock.now() - self._configured_s < _NEW_S
            server.check_links(is_new)
            return server.duplicate if is_new else ""

    @property
    def running(self) -> bool:
        """False once the driver thread has failed.

        The answer waits for the end of a transition, in which the thread may not run yet.
        """
        with self._lock:
            return self._server is None or self._server.running

    def stop(self) -> None:
        """Stop the vehicles, end their goals and close everything, in bounded time.

        Raises:
            DriverError: the driver's thread hangs; what it has not sent is not sent any more.
        """
        with self._lock:
            if self._server is None:
                self._spinner.stop(_SPINNER_S)
            else:
                self._server.stop([self._spinner])

    def close(self) -> None:
        """Destroy the nodes."""
        self._made.close()
        self.node.destroy_node()

    # --- transitions, each called by the node --------------------------------------------------

    def configure(self) -> None:
        """Create the vehicles and listen to them.

        Raises:
            ConfigurationError: parameters cannot be used.
            LinkError: a link cannot be opened, or the file of the signing key holds none.
            OSError: the recording cannot be written.
        """
        self._made = ExitStack()
        try:
            self._server = NavigationServer(
                self.node,
                self._spinner,
                self._given,
                self._argv,
                self._clock,
                self._made,
                resumed=self._resumed,
            )
        except BaseException:
            self._made.close()
            self._entities.destroy_new()
            raise
        self._configured_s, self._resumed = self._clock.now(), True
        self._server.start(self._trace)

    def activate(self) -> None:
        """Accept goals."""
        if self._server is not None:
            self._server.activate()

    def deactivate(self) -> None:
        """Stop the vehicles and end their goals; accept none."""
        if self._server is not None:
            self._server.deactivate()

    def clean_up(self) -> None:
        """Close the links, and destroy all but the node.

        Raises:
            DriverError: the driver's thread hangs.
        """
        if self._server is not None:
            self._server.stop()
        self._server = None
        self._made.close()
        self._entities.destroy_new()

    def shut_down(self) -> None:
        """Let the process stop as by a signal."""
        self.exit_wanted.set()

    def transition(self, work: Callable[[], None]) -> TransitionCallbackReturn:
        """Execute a transition; a failure is logged with its reason."""
        with self._lock:
            try:
                work()
            except (ConfigurationError, LinkError, OSError, DriverError) as error:
                self.node.get_logger().fatal(str(error))
                return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS


class _ManagedNode(LifecycleNodeMixin, Node):
    """Passes the transitions of a managed node on."""

    def __init__(self, given: list[Parameter], server: ManagedServer) -> None:
        with starting_ros():
            Node.__init__(self, SERVER_NODE_NAME, parameter_overrides=given)
        # A transition takes as long as its vehicles need to stop; other callbacks do not wait.
        group = MutuallyExclusiveCallbackGroup()
        LifecycleNodeMixin.__init__(self, callback_group=group)
        self._server = server
        self._change = self._service_change_state.callback
        self._service_change_state.callback = self._on_change_state

    def _on_change_state(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        """Reject what the state does not allow; rclpy 7.1 would give no answer at all."""
        wanted = request.transition
        for number, label, *_ in self._state_machine.available_transitions:
            if label == wanted.label or (not wanted.label and number == wanted.id):
                answer: ChangeState.Response = self._change(request, response)
                return answer
        _, state = self._state_machine.current_state
        self.get_logger().warning(
            f"There is no transition '{wanted.label or wanted.id}' in the state {state}."
        )
        response.success = False
        return response

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._server.transition(self._server.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._server.transition(self._server.activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._server.transition(self._server.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._server.transition(self._server.clean_up)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._server.transition(self._server.shut_down)


class _Entities:
    """Entities that a node has got since a moment: publishers, services, timers and the like."""

    def __init__(self, node: Node) -> None:
        """Note what there is."""
        self._node = node
        self._before = {kind: set(map(id, getattr(node, kind))) for kind in _KINDS}
        self._callbacks = list(node._on_set_parameters_callbacks)

    def destroy_new(self) -> None:
        """Destroy what has been created since."""
        node = self._node
        destroy: dict[str, Callable[[Any], object]] = {
            "publishers": node.destroy_publisher,
            "subscriptions": node.destroy_subscription,
            "clients": node.destroy_client,
            "services": node.destroy_service,
            "timers": node.destroy_timer,
            "guards": node.destroy_guard_condition,
            "waitables": lambda waitable: waitable.destroy(),
        }
        for kind in _KINDS:
            for entity in list(getattr(node, kind)):
                if id(entity) not in self._before[kind]:
                    destroy[kind](entity)
        for callback in list(node._on_set_parameters_callbacks):
            if callback not in self._callbacks:
                node.remove_on_set_parameters_callback(callback)
