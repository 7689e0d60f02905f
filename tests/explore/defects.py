"""Defects written by hand, each a mistake that a programmer makes. `mutants` hunts them."""

from __future__ import annotations

from typing import NamedTuple


class Mutant(NamedTuple):
    """A defect.

    Attributes:
        name: what is wrong.
        module: where.
        sound: the source as it is; once in the module.
        broken: what stands there instead.
    """

    name: str
    module: str
    sound: str
    broken: str


_GOALS = "navigation_bridge.clients.client_goals"
_REPORT = "navigation_bridge.reporting"
_ENGINE = "navigation_bridge.engine"
_EFFECTS = "navigation_bridge.effects"
_EVENTS = "navigation_bridge.vehicle_events"
_SERVICES = "navigation_bridge.clients.client_services"
_GOAL = "navigation_bridge.goals.active_goal"
_LINK_RULE = "navigation_bridge.rules.goal_rules"
_FLIGHT = "navigation_core.tasks.flying.flight"
_STOPPING = "navigation_core.tasks.flying.stopping"
_ARRIVAL = "navigation_core.tasks.flying.arrival"
_VEHICLE = "mavlink_vehicle.vehicle"
_STREAM = "mavlink_vehicle.protocols.streams.setpoint_stream"
_POINTS = "navigation_bridge.goals.point_requests"
_PLAN = "navigation_bridge.goals.mission_plan"
_RULES = "navigation_bridge.supervision.station_rules"
_STATIONS = "navigation_bridge.supervision.stations"
_PARKING = "navigation_bridge.supervision.parking"
_MISSION = "navigation_core.tasks.watching.mission"
_LANDING = "navigation_core.tasks.flying.target_landing"
_FOLLOWING = "navigation_core.tasks.steering.follow_target"
_LED = "navigation_core.tasks.watching.vehicle_led"
_TIMED = "navigation_core.trajectories.timed_trajectory"
_TIMED_CHECKS = "navigation_bridge.requests.trajectory_requests"
_TIMED_LEADER = "navigation_core.tasks.steering.trajectory_leader"

MUTANTS: tuple[Mutant, ...] = (
    Mutant("a cancel is forgotten", _GOALS, "            goal.begin_cancel(now)\n", ""),
    Mutant(
        "a goal continues after its end", _ENGINE,
        "        self.goal = None\n        outcome = self._parts.stations.name(outcome, now)",
        "        outcome = self._parts.stations.name(outcome, now)",
    ),
    Mutant(
        "a replaced goal has no end", _GOALS,
        "            self._report.ended(previous, replaced, now)\n", "            pass\n",
    ),
    Mutant("a pilot is not noticed", _EVENTS,
           "            self._parts.stations.take_away(goal, event.name, now, mode_number)",
           "            pass"),
    Mutant("a restart is not noticed", _EVENTS,
           '        self._engine.abandon(OutcomeCode.VEHICLE_REBOOTED, text, now)', "        pass"),
    Mutant("a lost link is waited for for ever", _LINK_RULE,
           "    if silence_s >= config.link_lost_abort_s:", "    if False:"),
    Mutant("a lost link is not reported", _ENGINE,
           "            return replace(progress, status=Status.LINK_LOST)",
           "            return progress"),
    Mutant("a shut-down does nothing", _GOALS,
           "        goal.stop(Outcome(why.code, why.message, None), now)",
           "        pass"),
    Mutant("a pause is not passed on", _GOAL, "        rejection = self.task.pause(now)",
           "        rejection = None"),
    Mutant("arming is not asked about", _SERVICES,
           "        if service is Service.ARM and not self._engine.config.goto.may_leave_ground:",
           "        if False:"),
    Mutant("a service lets the goal continue", _SERVICES,
           "            self._engine.end(goal, Outcome(OutcomeCode.PREEMPTED, text, None), now)",
           "            pass"),
    Mutant("the vehicle is left with a velocity", _EFFECTS,
           "        if (moving or velocity_only(vehicle.profile)) and vehicle.setpoints.is_open:",
           "        if False:"),
    Mutant("feedback stops without positions", _ENGINE,
           "        self._update(snapshot, 0.5, now)",
           "        self._update(snapshot, 1e9, now)"),
    Mutant("steps are twice as long", _ENGINE,
           "goal.times.step_begins(self.config.setpoint_period_s, now)",
           "goal.times.step_begins(20.0 * self.config.setpoint_period_s, now)"),
    Mutant("the setpoint continues in another mode", "navigation_bridge.rules.goal_rules",
           "    if takeover is None:", "    if True:"),
    Mutant("an end has no code", _REPORT, "        finished = goal.finish(outcome,",
           "        outcome = Outcome(outcome.code, '', None)\n"
           "        finished = goal.finish(outcome,"),
    Mutant("the result comes twice", _REPORT, "        self._outputs.append(finished)\n",
           "        self._outputs.append(finished)\n        self._outputs.append(finished)\n"),
    Mutant("the time remaining is negative", _REPORT,
           "time_remaining_s=progress.time_remaining_s,",
           "time_remaining_s=progress.time_remaining_s - 5.0,"),
    Mutant("the battery is in per cent", _REPORT,
           "battery_remaining=None if battery is None else battery.remaining,",
           "battery_remaining=None if battery is None or battery.remaining is None\n"
           "                else 100.0 * battery.remaining,"),
    Mutant("the path stays after the end", _REPORT, "        if goal.path_enu_m:\n"
           "            self._outputs.append(PlanChanged(()))\n", ""),
    Mutant("a service gets no answer", _REPORT,
           "        self._outputs.append(ServiceDone(number, success, message))", "        pass"),
    Mutant("a mode left is no end", _FLIGHT, "        if not observation.in_control:",
           "        if False:"),
    Mutant("a disarmed vehicle flies on", _FLIGHT, "        if not observation.armed:",
           "        if False:"),
    Mutant("a cancel is not obeyed", "navigation_core.tasks.phased_task",
           "        if self._cancel_asked and self._phase not in STOPPING:", "        if False:"),
    Mutant("a pause is not obeyed", _FLIGHT,
           "        elif self._pause_asked and self._phase in _PAUSABLE:", "        elif False:"),
    Mutant("positions are not missed", _FLIGHT,
           "        here = located(observation, self._config.position_stale_s)\n"
           "        if here is None:\n"
           "            return self._standing.lose_position(observation)\n        traffic =",
           "        here = located(observation, math.inf)\n"
           "        if here is None:\n"
           "            return self._standing.lose_position(observation)\n        traffic ="),
    Mutant("obstacles are not braked for", _FLIGHT,
           "        elif self._avoider is not None and "
           "not self._avoider.keeps_going(observation, now):", "        elif False:"),
    Mutant("a cancel ends at speed", _STOPPING,
           "        if still and commanded_m_s < _STANDS_M_S:", "        if True:"),
    Mutant("arrived is anywhere", _ARRIVAL,
           "        return error_m is not None and error_m <= self.radius_m",
           "        return error_m is not None"),
    Mutant("arrived is at any speed", _ARRIVAL,
           "        there = self.is_near(observation) and turned",
           "        there, slow = self.is_near(observation) and turned, True"),
    Mutant("nothing must brake", "navigation_core.safety.braking",
           "    if len(obstacles):", "    if False:"),
    Mutant("no path is in conflict", "navigation_core.planning.conflicts",
           "    if not len(obstacles) or not len(points_enu_m):", "    if True:"),
    Mutant("a missing flight ends a comparison", "navigation_core.planning.replanner",
           "        self.stop(place_enu_m, now)\n        self._planned_s",
           "        self.not_found(place_enu_m, now)\n        self._planned_s"),
    Mutant("disarming is forced", _VEHICLE, "ArmGoal(False, force)", "ArmGoal(False, True)"),
    Mutant("setpoints in any mode", _VEHICLE,
           "        if not self.in_control_mode and not profile.setpoints.outside_control_mode:",
           "        if False:"),
    Mutant("the yaw is not finite", _STREAM,
           "        yaw=normalize_angle(setpoint.yaw_ned_rad) if",
           "        yaw=math.nan * normalize_angle(setpoint.yaw_ned_rad) if"),
    Mutant("velocities are doubled", _STREAM, "        vx=velocity[0],",
           "        vx=2.0 * velocity[0],"),
    Mutant("velocities climb", _STREAM, "        vz=velocity[2],", "        vz=velocity[2] - 4.0,"),
    Mutant("the frame is another", _STREAM,
           "        coordinate_frame=frame,", "        coordinate_frame=12,"),
    Mutant("nobody is addressed", _STREAM,
           "        target_system=address.target_system,", "        target_system=0,"),
    Mutant("an acceleration that is not given counts", _STREAM,
           "        return mask\n", "        return mask & ~IGNORE_ACCELERATION\n"),
    Mutant("bad numbers are accepted", "navigation_bridge.tasks.admission",
           "        if rejection is not None:\n            return rejection\n", ""),
    Mutant("a rejection says nothing", "navigation_bridge.tasks.admission",
           'is active and on_new_goal is \'reject\'; cancel it first."', 'is active"'),
    Mutant("the volume is not watched", "navigation_bridge.rules.goal_rules",
           "    if left_m <= _LEFT_M or _VOLUME not in goal.facts:", "    if True:"),
    # --- guard and admission
    Mutant("the fence is not checked", "navigation_bridge.supervision.preflight",
            "    rejection = check_fence(snapshot, fence, plan, 0, plan.laps > 1, margins_m)",
            "    rejection = None"),
    Mutant("the volume is not checked", "navigation_core.safety.target_checks",
           "    if radius_m > volume.radius_max_m + RESOLUTION_M:",
           "    if False:"),
    Mutant("two goals at once", "navigation_bridge.tasks.admission",
           "    if active_goal_id is not None and not snapshot.config.replace_active_goal:",
           "    if False:"),
    Mutant("a goal with an old position", "navigation_bridge.tasks.admission",
           "    if age_s > stale_s:", "    if False:"),
    Mutant("base_link is about the origin", _POINTS,
           "        return add(pose.position_enu_m, frames.body_flu_to_enu(",
           "        return add((0.0, 0.0, 0.0), frames.body_flu_to_enu("),
    Mutant("base_link is not turned back to ENU", _POINTS,
           "frames.body_flu_to_enu(position, pose.yaw_enu_rad)",
           "frames.body_flu_to_enu(position, -pose.yaw_enu_rad)"),
    Mutant("the goal's speed is not used", _POINTS,
           "        speed = min(request.max_speed_m_s, speed_max_m_s)",
           "        speed = speed_max_m_s"),
    Mutant("the server's speed is no limit", _POINTS,
           "        speed = min(request.max_speed_m_s, speed_max_m_s)",
           "        speed = max(request.max_speed_m_s, speed_max_m_s)"),
    Mutant("infinity is a number", _POINTS,
           "for name, number in numbers.items() if not math.isfinite(number)]",
           "for name, number in numbers.items() if math.isnan(number)]"),
    Mutant("laps are counted from none", "navigation_bridge.tasks.navigate_waypoints",
           "    route = Route(waypoints, max(request.laps, 1), request",
           "    route = Route(waypoints, request.laps, request"),
    # --- ground stations, take-overs, parking, positions
    Mutant("a removed mission is only recorded", _RULES,
           "    return Consequence.CANCEL\n", "    return Consequence.NOTE\n"),
    Mutant("a station's pause is not passed on", _GOAL,
           "        self.paused_by = sentence\n        self.task.pause(now)\n",
           "        self.paused_by = sentence\n"),
    Mutant("a station cannot resume", _GOAL,
           "        if not self.paused_by_client:\n            self.task.unpause(now)\n", ""),
    Mutant("the stream stays open for a pilot", _STATIONS,
           "        self._vehicle.setpoints.close()\n        goal.times.due(now)",
           "        goal.times.due(now)"),
    Mutant("a take-over is never judged", "navigation_bridge.vehicle.takeover",
           "        if now - self.seen_s < _JUDGE_S:", "        if now - self.seen_s >= 0.0:"),
    Mutant("every pilot is a failsafe", "navigation_bridge.vehicle.takeover",
           "        if self.chosen or not fails:", "        if False:"),
    Mutant("the stream ends before the vehicle holds", _PARKING,
           "        self.deadline_s = now\n        self.operation_id",
           "        self.operation_id"),
    Mutant("parking never lets go", _PARKING,
           "        self.give_up()\n        self._vehicle.setpoints.close()\n        return True",
           "        return True"),
    Mutant("jumps of old goals count", "navigation_bridge.goals.succession",
           "        doubt=PositionDoubt(jumps_ned_m),", "        doubt=PositionDoubt(),"),
    # --- missions
    Mutant("latitude is longitude", _PLAN,
           "        x, y = round(latitude_deg * 1e7), round(longitude_deg * 1e7)",
           "        y, x = round(latitude_deg * 1e7), round(longitude_deg * 1e7)"),
    Mutant("an altitude is that above the sea", _PLAN,
           "            frame, altitude_m = RELATIVE_ALT, altitude_m - self._home_amsl_m",
           "            frame = RELATIVE_ALT"),
    Mutant("a mission does not wait", _PLAN,
           "        stay_s = float(math.ceil(waypoint.hold_time_s))", "        stay_s = 0.0"),
    Mutant("a mission has its own speed", _PLAN,
           "            if wanted_m_s is not None and wanted_m_s != speed_m_s:",
           "            if wanted_m_s is not None and wanted_m_s == speed_m_s:"),
    Mutant("home is an item", _PLAN,
           "        index = min(max(mission.current - offset, 0), count - 1)",
           "        index = min(max(mission.current, 0), count - 1)"),
    Mutant("a mission is not removed", "navigation_core.tasks.watching.mission_end",
           "        if not self.is_stored or changed:\n",
           "        if self.is_stored or changed:\n"),
    Mutant("a mission cannot be paused", _MISSION,
           "        if self._pauses_now(observation) or observation.position_doubt:\n"
           "            return Phase.PAUSING",
           "        if observation.position_doubt:\n"
           "            return Phase.PAUSING"),
    Mutant("a disarmed mission continues", _MISSION,
           '            text = "The vehicle was disarmed during its mission."\n'
           "            return Outcome(OutcomeCode.DISARMED, text, None)",
           "            return Wait()"),
    Mutant("a mission is over anywhere",
           "navigation_core.tasks.watching.mission_measures",
           "        if report is None or not report.complete or error_m is None or error_m > "
           "self._arrival_m():", "        if report is None or error_m is None:"),
    Mutant("the last item is never asked for", "mavlink_vehicle.protocols.mission.mission_upload",
           "        elif message.seq < len(self._items):",
           "        elif message.seq < len(self._items) - 1:"),
    Mutant("skipped waypoints count", "navigation_core.tasks.watching.mission_progress",
           "        return tuple(i for i in range(self.current) if i not in self._reached)",
           "        return tuple(range(self.current + 1))"),
    # --- landing, return
    Mutant("a landing is over in the air", "navigation_core.tasks.watching.led_measures",
           "        return not observation.armed and not is_airborne(",
           "        return not is_airborne("),
    Mutant("a return is over where it begins", _LED,
           "        return slow and home_m <= self._measures.arrival_m", "        return slow"),
    # --- obstacles and paths
    Mutant("the last look at a path is left out", "navigation_core.planning.planner",
           "    return path is not None and bool(obstacles.are_clear(path[:-1], path[1:], "
           "clearance_m).all())", "    return path is not None"),
    Mutant("the vehicle has no size", "navigation_bridge.goals.obstacle_admission",
           "        vehicle_radius_m=config.vehicle_radius_m,\n        margin_m=config.margin_m,",
           "        vehicle_radius_m=0.0,\n        margin_m=0.0,"),
    Mutant("obstacles are always far", "navigation_core.planning.planner",
           "    if not turns and obstacles.is_clear(start_enu_m, goal_enu_m, clearance_m):",
           "    if not turns:"),
    Mutant("a blocked path is waited at for ever", "navigation_core.planning.replanner",
           "        if self.blocked_for_s(now) > self._rules.blocked_timeout_s:",
           "        if self.blocked_for_s(now) < 0.0:"),
    Mutant("a silent sensor is trusted", "navigation_core.tasks.leading.avoider",
           "        self._is_silent = not age_s <= self._config.sensor_timeout_s",
           "        self._is_silent = False"),
    # --- traffic
    Mutant("a return never makes room", "navigation_core.tasks.flying.room_making",
           "        found = search.aside(here, ground_m)\n", "        found = None\n"),
    # --- the vehicle and its protocols
    Mutant("east is north", "mavlink_vehicle.positions.frames",
           "    east, north, up = vector_enu\n", "    north, east, up = vector_enu\n"),
    Mutant("a stranger is the vehicle", "mavlink_vehicle.protocols.known_vehicle",
           "        return header.srcComponent == state.component_id and (\n"
           "            state.system_id in (0, header.srcSystem)\n        )",
           "        return header.srcComponent == state.component_id"),
    Mutant("a command is sent once", "mavlink_vehicle.protocols.operations.command",
           "        self._last_attempt = sent_before + timing.retries + 1",
           "        self._last_attempt = sent_before + 1"),
    Mutant("any answer is ours", "mavlink_vehicle.protocols.operations.command",
           "        or message.command != command\n", ""),
    Mutant("a rejection is an end at once", "mavlink_vehicle.protocols.operations.evidence",
           "        return (\n            self.connected\n            and heard_s is not None",
           "        return (\n            heard_s is not None"),
    Mutant("an operation never ends", "mavlink_vehicle.protocols.operations.operations",
           "        elif now >= times.limit_s:\n            self._fire",
           "        elif now < times.limit_s - 1e9:\n            self._fire"),
    Mutant("silence is never noticed", "mavlink_vehicle.protocols.monitoring.heartbeat",
           "        if now >= self.deadline_s:\n", "        if now > self.deadline_s + 1e9:\n"),
    Mutant("a take-off is over on the ground",
           "mavlink_vehicle.protocols.operations.takeoff_goal",
           "        return height_m >= enough_m and slow", "        return slow"),
    Mutant("a take-off is as high as the sea",
           "mavlink_vehicle.protocols.operations.takeoff_goal",
           "math.nan, math.nan, math.nan, ground_m + self.height_m)",
           "math.nan, math.nan, math.nan, self.height_m)"),
    Mutant("a heading is in degrees", _STREAM,
           "        yaw=normalize_angle(setpoint.yaw_ned_rad) if",
           "        yaw=math.degrees(setpoint.yaw_ned_rad) if"),
    # --- targets
    Mutant("a lost target is landed on", _LANDING,
           "        return target.is_lost(now) and not _is_low("
           "here[2], target, observation.ground_enu_m)",
           "        return False"),
    Mutant("a target that is required is not needed", _LANDING,
           "            if self._goal.is_required:\n                text = f\"{text} The",
           "            if False:\n                text = f\"{text} The"),
    Mutant("anywhere is on the target", _LANDING,
           "        if off_m is None or off_m > OFF_MAX_M:", "        if off_m is None:"),
    Mutant("a lost target is followed on", _FOLLOWING,
           "        is_lost, lasted_s = target.is_lost(now), now",
           "        is_lost, lasted_s = False, now"),
    Mutant("the least distance is ignored", _FOLLOWING,
           "        wanted = guide.kept_off(wanted, position, yaw, target, now)\n", ""),
    Mutant("a route turns the other way", "navigation_core.tasks.leading.path_follower",
           "            self.carrot.turn_on(self._turn_rate_rad_s)",
           "            self.carrot.turn_on(-self._turn_rate_rad_s)"),
    Mutant("an old command is flown on", "navigation_core.tasks.steering.command_silence",
           "        if command is None or now - command.time_s > self._timeout_s:",
           "        if command is None:"),
    Mutant("a course leaves the volume", "navigation_core.tasks.steering.plane_course",
           "            ahead_m = room.farthest_m((x, y), way, far_m, self._inset_m)",
           "            ahead_m: float | None = far_m"),
    Mutant("the stop after a trajectory is not checked", _TIMED_CHECKS,
           "    end_s = timed.trajectory.duration_s\n", "    end_s = timed.times_s[-1]\n"),
    Mutant("a trajectory begins anywhere", _TIMED_CHECKS,
           "    if not away_m <= most_m:", "    if away_m < 0.0:"),
    Mutant("a trajectory climbs as fast as it was planned", _TIMED,
           '        ("climbs", limits.speed_up_m_s,', '        ("climbs", 99.0,'),
    Mutant("a trajectory that ends in motion has no stop", _TIMED,
           "        motion = motion.then(plan_stop(end, limits))\n", "        pass\n"),
    Mutant("a trajectory is joined with a jump", _TIMED,
           "    if _is_same(start, here):", "    if here is not None:"),
    Mutant("bounds are not looked at along a trajectory", _TIMED_LEADER,
           "            if not inside:\n", "            if not inside and not reason:\n"),
)  # fmt: skip


REASONS = {
    "a pilot is not noticed": "the task sees the mode by itself and ends with the same code",
    "the setpoint continues in another mode": "the task sees the mode by itself",
    "a mode left is no end": "the bridge's own watch of the mode ends the goal before",
    "setpoints in any mode": "nobody offers a setpoint in another mode",
    "the stream stays open for a pilot": "the vehicle's interlock rejects setpoints in other modes",
    "parking never lets go": "the vehicle's interlock ends it with the mode",
    "the last look at a path is left out": "searches keep clear by themselves",
    "a rejection is an end at once": "no operation ends while the link is lost in the seeds",
    "a take-off is over on the ground": "other conditions of a take-off hold it up",
    "jumps of old goals count": "a position that has jumped is trusted again within a minute",
    "a return never makes room": "it waits for others longer, and goes on",
    "the least distance is ignored": "a target is followed from its far side on a path around it",
    "a stranger is the vehicle": "its frames do not change what is sent",
    "bounds are not looked at along a trajectory": "all is checked before, and no fence shrinks",
}
"""Why some are not found."""


TOGETHER = (
    (
        *("the setpoint continues in another mode", "a pilot is not noticed"),
        *("a mode left is no end", "setpoints in any mode", "the stream stays open for a pilot"),
    ),
    ("no path is in conflict", "nothing must brake"),
)
"""Defects that mask each other: each check stands behind another one."""


def planted(source: str, mutant: Mutant) -> str:
    """Return a source with a defect.

    Raises:
        ValueError: the sound text is not there exactly once.
    """
    if source.count(mutant.sound) != 1:
        raise ValueError(
            f"{mutant.name!r}: its text occurs {source.count(mutant.sound)} times in "
            f"{mutant.module}; change it in tests/explore/defects.py."
        )
    return source.replace(mutant.sound, mutant.broken)
