"""The numeric half of the simulation: all vehicles' bodies, sensors and controllers in step.

One pipeline of pure functions over lanes, whatever the number of vehicles. Knows nothing of
MAVLink or of modes; `Guidance` goes in, `Motion` comes out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.autopilot import control_state, controller
from mavlink_sitl.dynamics import battery, quadrotor
from mavlink_sitl.exchange import BatteryReading, Guidance, Motion
from mavlink_sitl.ops import Lane, Ops, ops_for
from mavlink_sitl.world import sensors

DT_S = 0.01

Vector = tuple[float, float, float]


class Physics:
    """Bodies, batteries, sensors and controllers of N vehicles.

    Args:
        yaw_rad: each vehicle's heading at start; its position is its own origin.
        packs: each vehicle's battery; they share a model for now, the first one's.
        remaining: each vehicle's charge at start, 0..1.
        seed: of the sensors.
        wind_ned_m_s: speed of the air.
    """

    def __init__(
        self,
        yaw_rad: Sequence[float],
        pack: battery.BatteryModel,
        remaining: Sequence[float],
        seed: int,
        wind_ned_m_s: tuple[float, float, float],
    ) -> None:
        """See the class."""
        self.count = len(yaw_rad)
        self.o: Ops = ops_for(self.count)
        o = self.o
        zero = o.full(0.0)
        self.body_model = quadrotor.QuadrotorModel()
        self.sensor_model = sensors.SensorModel()
        self.gains = control_state.ControllerGains()
        self.pack = pack
        self.wind = (
            o.full(wind_ned_m_s[0]),
            o.full(wind_ned_m_s[1]),
            o.full(wind_ned_m_s[2]),
        )
        self.wind_ned_m_s = wind_ned_m_s
        self.ground_down_m = zero
        self.body = quadrotor.at_rest(zero, zero, zero, o.pack(list(yaw_rad)), o)
        self.error = sensors.no_error(o)
        self.battery = battery.charged(o.pack(list(remaining)), pack, o)
        self.gps_fix = zero == zero
        still = control_state.targets_of(Guidance())
        self.targets = control_state.Targets(*(o.full(value) for value in still))
        self.control = control_state.initial(self._belief(), o)
        self.gps_sample = (0.0, self.body, self.error)
        self._noise = sensors.Noise(seed, self.count)

    def at(self, lane: Lane, index: int) -> float:
        """One vehicle's number."""
        return float(lane) if self.count == 1 else float(lane[index])

    def with_value(self, lane: Lane, index: int, value: float) -> Lane:
        """The lane with one vehicle's number changed."""
        if self.count == 1:
            return value
        changed = lane.copy()
        changed[index] = value
        return changed

    def _belief(self) -> control_state.Belief:
        body, error = self.body, self.error
        return control_state.Belief(
            body.north_m + error.north_m,
            body.east_m + error.east_m,
            body.down_m + error.down_m,
            body.velocity_north_m_s + error.rate_north_m_s,
            body.velocity_east_m_s + error.rate_east_m_s,
            body.velocity_down_m_s + error.rate_down_m_s,
            body.yaw_rad,
            body.on_ground,
        )

    # Steps.

    def step(self) -> None:
        """Controllers and bodies, DT_S onwards."""
        o = self.o
        self.control, output = controller.step(
            self.control, self.targets, self._belief(), DT_S, self.gains, o
        )
        self.body = quadrotor.step(
            self.body,
            quadrotor.QuadrotorCommand(*output),
            self.wind,
            self.ground_down_m,
            DT_S,
            self.body_model,
            o,
        )
        self.error = sensors.advance(self.error, DT_S)

    def step_sensors(self, time_s: float) -> None:
        """The receivers' turn: once per sensor_model.update_s."""
        o = self.o
        noise = self._noise.draw(o)
        self.error = sensors.update(self.error, noise, self.gps_fix, self.sensor_model, o)
        self.gps_sample = (time_s, self.body, self.error)

    def step_batteries(self, dt: float) -> None:
        """Draw current for dt seconds."""
        load = self.body.thrust_m_s2 / quadrotor.GRAVITY_M_S2
        self.battery = battery.step(self.battery, load, dt, self.pack, self.o)

    def guide(self, index: int, guidance: Guidance) -> None:
        """Give a vehicle's controllers new guidance."""
        one = control_state.targets_of(guidance)
        if self.count == 1:
            self.targets = one
        else:
            for lane, value in zip(self.targets, one, strict=True):
                lane[index] = value
        belief = self._belief()
        if self.count > 1:
            belief = control_state.Belief(*(lane[index] for lane in belief))
        self.control = control_state.retargeted(
            self.control, guidance, belief, lambda lane, value: self.with_value(lane, index, value)
        )

    # Views.

    def moving_target(self, index: int) -> tuple[float, float, float]:
        """Where a vehicle's target is now, NED metres."""
        horizontal = self.control.horizontal
        return (
            self.at(horizontal.target_north_m, index),
            self.at(horizontal.target_east_m, index),
            self.at(self.control.vertical.target_down_m, index),
        )

    def motion(self, index: int, truth: bool = False) -> Motion:
        """Where a vehicle believes to be, or where it is."""
        return self._motion(self.body, None if truth else self.error, index)

    def gps(self, index: int) -> tuple[float, Vector, Vector]:
        """Time, position and velocity of the receiver's latest sample."""
        time_s, body, error = self.gps_sample
        motion = self._motion(body, error, index)
        return time_s, motion[:3], motion[3:6]

    def _motion(
        self, body: quadrotor.QuadrotorState, error: sensors.EstimateError | None, index: int
    ) -> Motion:
        if self.count == 1:
            n, e, d, v_n, v_e, v_d, lean_n, lean_e, rate_n, rate_e = body[:10]
            yaw, yaw_rate = body.yaw_rad, body.yaw_rate_rad_s
            errors: tuple[float, ...] = error or (0.0,) * 6
        else:
            n, e, d, v_n, v_e, v_d, lean_n, lean_e, rate_n, rate_e = (
                float(lane[index]) for lane in body[:10]
            )
            yaw, yaw_rate = float(body.yaw_rad[index]), float(body.yaw_rate_rad_s[index])
            errors = (0.0,) * 6 if error is None else tuple(float(lane[index]) for lane in error)
        c, s = math.cos(yaw), math.sin(yaw)
        forward, right = lean_n * c + lean_e * s, lean_e * c - lean_n * s
        pitch = -math.atan(forward)
        return Motion(
            n + errors[0],
            e + errors[1],
            d + errors[2],
            v_n + errors[3],
            v_e + errors[4],
            v_d + errors[5],
            math.atan(right * math.cos(pitch)),
            pitch,
            yaw,
            rate_e * c - rate_n * s,
            -(rate_n * c + rate_e * s),
            yaw_rate,
        )

    def battery_reading(self, index: int, capacity_mah: float) -> BatteryReading:
        """What a vehicle's power monitor says, told how much the pack holds."""
        state = self.battery
        consumed = self.at(state.consumed_mah, index)
        return BatteryReading(
            self.at(state.voltage_v, index),
            self.at(state.current_a, index),
            consumed,
            self.at(state.consumed_wh, index),
            max(100.0 * (1.0 - consumed / max(capacity_mah, 1.0)), 0.0),
        )

    def table(self, *names: str) -> NDArray[np.float64]:
        """Fields of the bodies as an array of shape (N, len(names))."""
        return np.array([self.o.unpack(getattr(self.body, name)) for name in names]).T

    def put_at_origin(self, index: int) -> None:
        """Make where a vehicle is its origin: a firmware that starts again does that."""
        ground = self.at(self.ground_down_m, index) - self.at(self.body.down_m, index)
        self.ground_down_m = self.with_value(self.ground_down_m, index, ground)
        for name in ("north_m", "east_m", "down_m"):
            lane = self.with_value(getattr(self.body, name), index, 0.0)
            self.body = self.body._replace(**{name: lane})
        self.error = sensors.EstimateError(
            *(self.with_value(lane, index, 0.0) for lane in self.error)
        )
