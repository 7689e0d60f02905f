"""The numeric half of the simulation: all vehicles' bodies, sensors and controllers in step.

One pipeline of pure functions over lanes, whatever the number of vehicles. Knows nothing of
MAVLink or of modes; `Guidance` goes in, `Motion` comes out.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.array_ops import Lane, Ops, ops_for
from mavlink_sitl.autopilot.control import control_state, controller
from mavlink_sitl.autopilot.control.control_state import ControllerGains
from mavlink_sitl.autopilot.px4.multicopter import position_law
from mavlink_sitl.dynamics import at_rest, battery, quadrotor
from mavlink_sitl.dynamics.quadrotor import QuadrotorModel
from mavlink_sitl.exchange import GRAVITY_M_S2, BatteryReading, Guidance, Motion, Vector
from mavlink_sitl.world import sensors

DT_S = 0.01
"""The usual step"""

_VELOCITY = ("velocity_north_m_s", "velocity_east_m_s", "velocity_down_m_s")
MISLED_PER_UPDATE = 0.2
"""Part of a receiver's error that the estimator takes over at each update, near enough EKF3"""

Lanes3 = tuple[Lane, Lane, Lane]
"""North, East and down"""
GpsSample = tuple[float, Vector, Vector]
"""Time, and NED position and velocity"""


class PhysicsStart(NamedTuple):
    """The initial state of the physics of N vehicles.

    Attributes:
        yaw_rad: each vehicle's heading; its position is its own origin.
        pack: the battery that all have.
        remaining: each vehicle's charge, 0..1.
        seed: of the sensors.
        dt_s: the step, s.
    """

    yaw_rad: list[float]
    pack: battery.BatteryModel
    remaining: list[float]
    seed: int
    dt_s: float = DT_S


class Physics:
    """Bodies, batteries, sensors and controllers of N vehicles.

    Attributes:
        flies: they leave the ground, and lean.
        dt_s: the step, s.
        body_model: what they are built like.
        state: the form of their state.
        gains: of their controllers.
        over_ground: the law of their motion over ground.
        up_and_down: the law of their climb and descent.
    """

    flies = True
    body_model: Any = quadrotor.QuadrotorModel()
    state: Any = quadrotor.QuadrotorState
    gains: Any = control_state.ControllerGains()
    over_ground: controller.HorizontalLaw = staticmethod(controller.horizontal)
    up_and_down: controller.VerticalLaw = staticmethod(controller.vertical)

    def __init__(self, start: PhysicsStart) -> None:
        self.count = len(start.yaw_rad)
        self.dt_s = start.dt_s
        self.o: Ops = ops_for(self.count)
        o = self.o
        zero = o.full(0.0)
        self.sensor_model = sensors.SensorModel()
        self.pack = start.pack
        self.wind: Lanes3 = (zero, zero, zero)
        self.ground_down_m = zero
        self.body = at_rest(self.state, o.pack(start.yaw_rad), o)
        self.error = sensors.no_error(o)
        self.battery = battery.charged(o.pack(start.remaining), start.pack, o)
        self.gps_fix = zero == zero
        still = control_state.targets_of(Guidance())
        self.targets = control_state.Targets(*(o.full(value) for value in still))
        self.control = control_state.initial(self._belief(), o)
        self.gps_sample = (0.0, self.body, self.error)
        self._noise = sensors.Noise(start.seed, self.count)
        self._glitch = self._misled = (zero, zero, zero)
        self.efficiency = o.full(1.0)
        # Rows of what single vehicles ask for, and the states that they were made of.
        self._rows: tuple[Any, Any, list[Motion]] = (None, None, [])
        self._true_rows: tuple[Any, list[Motion]] = (None, [])
        self._turns: tuple[Any, tuple[Lane, ...]] = (None, ())
        self._gps_rows: tuple[Any, list[GpsSample]] = (None, [])
        self._contact_rows: tuple[Any, list[Any]] = (None, [])
        self._battery_rows: tuple[Any, list[BatteryReading]] = (None, [])

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
        return _belief(self.body, self.error)

    # Steps.

    def step(self) -> None:
        """Controllers and bodies, a step onwards."""
        self.control, self.body, self.error = _fly(
            self.control,
            self.targets,
            self.body,
            self.error,
            (self.efficiency, self.wind, self.ground_down_m),
            self.dt_s,
            self.gains,
            self.body_model,
            self.o,
            (self.over_ground, self.up_and_down),
        )

    def step_sensors(self, time_s: float) -> None:
        """The receivers' turn: once per sensor_model.update_s."""
        o = self.o
        noise = self._noise.draw(o)
        n, e, d = (
            m + (g - m) * MISLED_PER_UPDATE for m, g in zip(self._misled, self._glitch, strict=True)
        )
        self._misled = (n, e, d)
        self.error = sensors.update(
            self.error, noise, self.gps_fix, self.sensor_model, o, self._misled
        )
        self.gps_sample = (time_s, self.body, self.error)

    def step_batteries(self, dt: float) -> None:
        """Draw current for dt seconds."""
        load = self.body.thrust_m_s2 / GRAVITY_M_S2
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
            self.control,
            guidance,
            belief,
            self.gains,
            lambda lane: self.at(lane, index),
            lambda lane, value: self.with_value(lane, index, value),
        )

    # Views.

    def servos(self, index: int) -> tuple[int, ...]:
        """Servo outputs of vehicles other than those with four equal motors, microseconds."""
        return ()

    def airspeed_m_s(self, index: int) -> float | None:
        """The measured airspeed; None without a sensor."""
        return None

    def wind_at(self, index: int) -> Vector:
        """The wind on a vehicle, NED m/s."""
        return self._vector(self.wind, index)

    def _vector(self, lanes: Lanes3, index: int) -> Vector:
        north, east, down = lanes
        return self.at(north, index), self.at(east, index), self.at(down, index)

    def moving_target(self, index: int) -> Vector:
        """The present target of a vehicle, NED metres."""
        level, upright = self.control.horizontal, self.control.vertical
        target = (level.target_north_m, level.target_east_m, upright.target_down_m)
        return self._vector(target, index)

    def motion(self, index: int, truth: bool = False) -> Motion:
        """The estimated or the true motion of a vehicle."""
        body, error = self.body, self.error
        if truth:
            if self._true_rows[0] is not body:
                self._true_rows = (body, self._motions(body, None))
            return self._true_rows[1][index]
        if self._rows[0] is not body or self._rows[1] is not error:
            self._rows = (body, error, self._motions(body, error))
        return self._rows[2][index]

    def gps(self, index: int) -> GpsSample:
        """Time, position and velocity of the receiver's latest sample."""
        sample = self.gps_sample
        if self._gps_rows[0] is not sample:
            time_s, body, error = sample
            rows = zip(*map(self.o.unpack, _places(body, error)), strict=True)
            samples = [(time_s, (n, e, d), (v_n, v_e, v_d)) for n, e, d, v_n, v_e, v_d in rows]
            self._gps_rows = (sample, samples)
        return self._gps_rows[1][index]

    def contact(self, index: int) -> tuple[bool, float, float]:
        """Whether a vehicle touches the ground, its latest impact (m/s), its thrust (m/s2)."""
        body = self.body
        if self._contact_rows[0] is not body:
            lanes = (body.on_ground, body.impact_m_s, body.thrust_m_s2)
            self._contact_rows = (body, list(zip(*map(self.o.unpack, lanes), strict=True)))
        row: tuple[bool, float, float] = self._contact_rows[1][index]
        return row

    def _motions(self, body: Any, error: sensors.EstimateError | None) -> list[Motion]:
        """All vehicles' motion; made once per tick, since everybody asks at the same ticks."""
        if self._turns[0] is not body:
            self._turns = (body, self._turn_lanes(body))
        columns = (*_places(body, error or sensors.no_error(self.o)), *self._turns[1])
        if self.count == 1:
            return [Motion(*columns)]
        return list(map(Motion._make, zip(*map(self.o.unpack, columns), strict=True)))

    def _turn_lanes(self, body: Any) -> tuple[Lane, ...]:
        """Roll, pitch, yaw and their rates, as lanes."""
        o = self.o
        c, s = o.cos(body.yaw_rad), o.sin(body.yaw_rad)
        forward = body.lean_north * c + body.lean_east * s
        right = body.lean_east * c - body.lean_north * s
        pitch = o.atan2(-forward, 1.0)
        return (
            o.atan2(right * o.cos(pitch), 1.0),
            pitch,
            body.yaw_rad,
            body.lean_rate_east_1_s * c - body.lean_rate_north_1_s * s,
            -(body.lean_rate_north_1_s * c + body.lean_rate_east_1_s * s),
            body.yaw_rate_rad_s,
        )

    def battery_reading(self, index: int, capacity_mah: float) -> BatteryReading:
        """The reading of a vehicle's power monitor, given the capacity of the pack."""
        state = self.battery
        if self._battery_rows[0] is not state:
            fraction = 1.0 - state.consumed_mah / max(self.pack.capacity_mah, 1.0)
            left = self.o.maximum(100.0 * fraction, 0.0)
            lanes = (state.voltage_v, state.current_a, state.consumed_mah, state.consumed_wh, left)
            rows = zip(*map(self.o.unpack, lanes), strict=True)
            self._battery_rows = (state, list(map(BatteryReading._make, rows)))
        row = self._battery_rows[1][index]
        if capacity_mah == self.pack.capacity_mah:
            return row
        left = max(100.0 * (1.0 - row.consumed_mah / max(capacity_mah, 1.0)), 0.0)
        return row._replace(remaining_percent=left)

    def table(self, *names: str) -> NDArray[np.float64]:
        """Fields of the bodies as an array of shape (N, len(names))."""
        return np.array([self.o.unpack(getattr(self.body, name)) for name in names]).T

    def mislead(self, index: int, offset_ned_m: Vector) -> None:
        """Let a vehicle's estimator believe that it is elsewhere, within seconds."""
        self._glitch = self._with_vector(self._glitch, index, offset_ned_m)

    def _with_vector(self, lanes: Lanes3, index: int, vector: Vector) -> Lanes3:
        n, e, d = (self.with_value(x, index, value) for x, value in zip(lanes, vector, strict=True))
        return n, e, d

    def reset_estimate(self, index: int, offset_ned_m: Vector) -> None:
        """Let a vehicle's estimator jump to the position of its receiver, which has this error.

        The controllers' targets shift with the estimate, so that the vehicle does not move: both
        firmwares do so (AC_PosControl's handling of EKF resets, PX4's reset counters). A setpoint
        that comes later is relative to the new estimate.
        """
        old = self.misled_by(index)
        self.mislead(index, offset_ned_m)
        self._misled = self._with_vector(self._misled, index, offset_ned_m)
        self._jump(index, offset_ned_m[0] - old[0], offset_ned_m[1] - old[1])

    def regain_position(self, index: int) -> None:
        """Let an estimate that went astray without a fix jump to where its receiver says it is.

        A real ArduCopter did so by 11.6 m in one step, with the velocity of the vehicle and none of
        the jump; a PX4 by 35 m.
        """
        error, off = self.error, self.misled_by(index)
        north_m = off[0] - self.at(error.north_m, index)
        east_m = off[1] - self.at(error.east_m, index)
        if math.hypot(north_m, east_m) < sensors.ASTRAY_M:
            return
        self._jump(index, north_m, east_m)
        self.error = self.error._replace(
            rate_north_m_s=self.with_value(error.rate_north_m_s, index, 0.0),
            rate_east_m_s=self.with_value(error.rate_east_m_s, index, 0.0),
        )

    def _jump(self, index: int, north_m: float, east_m: float) -> None:
        """Move a vehicle's estimate, and the targets of its controllers with it."""

        def moved(lane: Lane, by_m: float) -> Lane:
            return self.with_value(lane, index, self.at(lane, index) + by_m)

        self.error = self.error._replace(
            north_m=moved(self.error.north_m, north_m), east_m=moved(self.error.east_m, east_m)
        )
        level = self.control.horizontal
        level = level._replace(
            target_north_m=moved(level.target_north_m, north_m),
            target_east_m=moved(level.target_east_m, east_m),
            north_m=moved(level.north_m, north_m),
            east_m=moved(level.east_m, east_m),
        )
        self.control = self.control._replace(horizontal=level)

    def misled_by(self, index: int) -> Vector:
        """The part of a receiver's error that a vehicle's estimator has adopted."""
        return self._vector(self._misled, index)

    def weaken(self, index: int, efficiency: float) -> None:
        """Scale the thrust of a vehicle's motors by a factor."""
        self.efficiency = self.with_value(self.efficiency, index, efficiency)

    def stop_dead(self, index: int) -> None:
        """Stop a vehicle at once: it has hit something."""
        self._zero(index, *_VELOCITY)

    def _zero(self, index: int, *names: str) -> None:
        """Let fields of a vehicle's body be 0."""
        lanes = {name: self.with_value(getattr(self.body, name), index, 0.0) for name in names}
        self.body = self.body._replace(**lanes)

    def put(self, index: int, place_ned_m: Vector, velocity_ned_m_s: Vector) -> None:
        """Put a vehicle somewhere, moving; one that flies hovers, or continues, with motors on."""
        north, east, down = place_ned_m
        values = {"north_m": north, "east_m": east}
        values |= zip(_VELOCITY, velocity_ned_m_s, strict=True)
        if self.flies:
            values |= {"down_m": down, "thrust_m_s2": GRAVITY_M_S2, "on_ground": False}
        lanes = {
            name: self.with_value(getattr(self.body, name), index, value)
            for name, value in values.items()
        }
        self.body = self.body._replace(**lanes)
        self._believe_truth(index)
        if self.flies:
            begun = control_state.initial(self._belief(), self.o)._replace(spool=self.o.full(1.0))
            self.control = self._with_rows_of(self.control, begun, index)

    def _with_rows_of(self, old: Any, new: Any, index: int) -> Any:
        """The controllers' state with one vehicle's values replaced by those of `new`."""
        if isinstance(old, tuple):
            pairs = zip(old, new, strict=True)
            return type(old)._make(self._with_rows_of(was, now, index) for was, now in pairs)  # type: ignore[attr-defined]
        return self.with_value(old, index, self.at(new, index))

    def put_at_origin(self, index: int) -> None:
        """Make where a vehicle is its origin: a firmware that starts again does that."""
        ground = self.at(self.ground_down_m, index) - self.at(self.body.down_m, index)
        self.ground_down_m = self.with_value(self.ground_down_m, index, ground)
        self._zero(index, "north_m", "east_m", "down_m")
        self._believe_truth(index)

    def _believe_truth(self, index: int) -> None:
        self.error = sensors.EstimateError(
            *(self.with_value(lane, index, 0.0) for lane in self.error)
        )


def _fly(
    control: control_state.ControllerState,
    targets: control_state.Targets,
    body: quadrotor.QuadrotorState,
    error: sensors.EstimateError,
    felt: tuple[Lane, Lanes3, Lane],
    dt_s: float,
    gains: control_state.ControllerGains,
    model: quadrotor.QuadrotorModel,
    o: Ops,
    laws: tuple[controller.HorizontalLaw, controller.VerticalLaw],
) -> tuple[control_state.ControllerState, quadrotor.QuadrotorState, sensors.EstimateError]:
    """Controllers, bodies and errors, a step onwards; `felt` are efficiency, wind and ground."""
    efficiency, wind, ground_down_m = felt
    believed = _belief(body, error)
    control, output = controller.step(control, targets, believed, dt_s, gains, o, *laws)
    lean_n, lean_e, thrust, yaw_rate = output
    command = quadrotor.QuadrotorCommand(lean_n, lean_e, thrust * efficiency, yaw_rate)
    body = quadrotor.step(body, command, wind, ground_down_m, dt_s, model, o)
    return control, body, sensors.advance(error, dt_s)


def _belief(body: Any, error: sensors.EstimateError) -> control_state.Belief:
    n, e, d, v_n, v_e, v_d = _places(body, error)
    return control_state.Belief(n, e, d, v_n, v_e, v_d, body.yaw_rad, body.on_ground)


def _places(body: Any, error: sensors.EstimateError) -> tuple[Lane, Lane, Lane, Lane, Lane, Lane]:
    """Where vehicles believe to be, and how fast."""
    n, e, d, v_n, v_e, v_d = body[:6]
    off_n, off_e, off_d, off_v_n, off_v_e, off_v_d = error
    return (n + off_n, e + off_e, d + off_d, v_n + off_v_n, v_e + off_v_e, v_d + off_v_d)


BODY = QuadrotorModel(
    drag_linear_1_s=1.0,
    drag_quadratic_1_m=0.0,
    attitude_rate_rad_s=6.0,
    attitude_damping=1.0,
    yaw_time_constant_s=0.15,
    yaw_share=1.0,
    max_lean=1.0,
)
"""The real simulator's own quadrotor: its drag grows with speed (SIH_KDV over SIH_MASS), and its
attitude follows MC_PITCH_P (6.5) and the rate loop behind it. Fitted to legs of 5, 15, 20 and
30 m in OFFBOARD: 0.9, 2.5, 4.1, 5.5 and 6.5 m/s after 0.3, 0.6, 0.9, 1.2 and 1.5 s"""
UNFILTERED_HZ = 1e3
GAINS = ControllerGains(
    position_xy=0.95,
    velocity_xy=1.8,
    velocity_xy_i=0.4,
    velocity_xy_d=0.0,
    filter_xy_hz=UNFILTERED_HZ,
    velocity_z=4.0,
    velocity_z_i=2.0,
    filter_z_hz=UNFILTERED_HZ,
    direct_push_z=True,
    restart_keeps_lean=False,
    max_lean=1.0,
    most_faster_m_s=20.0,
    yaw=3.0,
    shapes_yaw=False,
)
"""MPC_XY_P, MPC_XY_VEL_P_ACC, MPC_XY_VEL_I_ACC, MPC_Z_VEL_P_ACC, MPC_Z_VEL_I_ACC, MPC_TILTMAX_AIR
(45 degrees). MPC_XY_VEL_D_ACC stands in the law of OFFBOARD."""


class Px4Physics(Physics):
    """`Physics` with PX4's laws and the body that they were recorded with."""

    body_model = BODY
    gains = GAINS
    over_ground = staticmethod(position_law.horizontal)
    up_and_down = staticmethod(position_law.vertical)
