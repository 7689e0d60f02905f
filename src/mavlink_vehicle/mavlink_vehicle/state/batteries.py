"""Reads the batteries, and finds what decides whether a vehicle may fly on. Pure.

The worst counts: the worst charge state, and the lowest remaining charge, of all batteries but
those of a payload (MAV_BATTERY_FUNCTION_PAYLOAD). One for avionics counts by its charge state
alone, as flying does not empty it. SYS_STATUS counts only without BATTERY_STATUS, or where that
has ended.
"""

from __future__ import annotations

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.state.telemetry import Battery
from mavlink_vehicle.state.vehicle_state import VehicleState

SILENT_S = 15.0
"""A battery without a report for this time is gone; a PX4 sends BATTERY_STATUS every 2 s"""

_UINT16_MAX, _INT16_MAX = 0xFFFF, 0x7FFF
_SPLIT_MV = 0xFFFE
_PAYLOAD = mavlink.MAV_BATTERY_FUNCTION_PAYLOAD
_AVIONICS = mavlink.MAV_BATTERY_FUNCTION_AVIONICS
_CHARGE_RANK = {
    mavlink.MAV_BATTERY_CHARGE_STATE_LOW: 1,
    mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL: 2,
    mavlink.MAV_BATTERY_CHARGE_STATE_EMERGENCY: 3,
    mavlink.MAV_BATTERY_CHARGE_STATE_FAILED: 4,
}


def charge_rank(battery: Battery | None) -> int:
    """Return how bad the autopilot calls a battery: 0, or 1 (low) to 4 (failed)."""
    return 0 if battery is None else _CHARGE_RANK.get(battery.charge_state, 0)


def read_battery(
    message: mavlink.MAVLink_battery_status_message, autopilot: int, now: float
) -> Battery:
    """Return what BATTERY_STATUS says.

    https://mavlink.io/en/messages/common.html#BATTERY_STATUS has the markers for unknown.

    Args:
        message: the message.
        autopilot: MAV_AUTOPILOT.
        now: time in seconds.
    """
    # Both firmwares put the pack's voltage into the first cells when they don't know cells (above
    # 65.534 V into two); in every case the sum of the valid entries is the pack's voltage.
    cells_mv = [mv for mv in message.voltages if mv not in (0, _UINT16_MAX)]
    cells_mv += [mv for mv in message.voltages_ext if mv not in (0, _UINT16_MAX)]
    current_ca, consumed_mah = message.current_battery, message.current_consumed
    # PX4 also writes its own "unknown" of -1 A, as -100, and adds up the charge from it.
    unknown_current = current_ca == -1 or (
        current_ca == -100 and autopilot == mavlink.MAV_AUTOPILOT_PX4
    )
    single = len(cells_mv) > 1 and _SPLIT_MV not in cells_mv
    temperature_cdeg = message.temperature
    return Battery(
        now,
        fraction(message.battery_remaining),
        sum(cells_mv) / 1000 if cells_mv else None,
        None if unknown_current else current_ca / 100,
        None if consumed_mah < 0 else consumed_mah / 1000,
        message.charge_state,
        battery_id=message.id,
        function=message.battery_function,
        chemistry=message.type,
        cell_voltages_v=tuple(mv / 1000 for mv in cells_mv) if single else (),
        temperature_c=None if temperature_cdeg == _INT16_MAX else temperature_cdeg / 100,
        time_remaining_s=float(message.time_remaining) if message.time_remaining > 0 else None,
        mode=message.mode,
        faults=message.fault_bitmask,
    )


def with_battery(state: VehicleState, battery: Battery, now: float) -> tuple[Battery, ...]:
    """Return the batteries with a report, without what was taken out on the ground.

    One that falls silent in flight keeps its last word.
    """
    others = (
        other
        for other in state.batteries
        if other.battery_id != battery.battery_id
        and (state.armed or now - other.time_s <= SILENT_S)
    )
    return tuple(sorted((*others, battery), key=lambda known: known.battery_id))


def deciding(batteries: tuple[Battery, ...], summary: Battery | None, now: float) -> Battery | None:
    """Return the worst battery, with the lowest charge of all that count; None without any.

    Args:
        batteries: as BATTERY_STATUS has them.
        summary: as SYS_STATUS has it.
        now: time in seconds.
    """
    counting = [battery for battery in batteries if battery.function != _PAYLOAD]
    flown = [battery for battery in counting if battery.function != _AVIONICS]
    known = [battery for battery in flown if battery.remaining is not None]
    # An ArduPilot that has not measured its battery yet sends 100 % in SYS_STATUS, and -1 here.
    if summary is not None and all(now - battery.time_s > SILENT_S for battery in flown):
        counting.append(summary)
        known.append(summary)
    if not counting:
        return None
    lowest = min(
        (share for battery in known if (share := battery.remaining) is not None), default=None
    )
    worst = max(counting, key=lambda battery: (charge_rank(battery), -_charge(battery)))
    return worst if worst.remaining == lowest else worst._replace(remaining=lowest)


def _charge(battery: Battery) -> float:
    """Return the charge to sort by: one that counts before one that does not, or is unknown."""
    unknown = battery.remaining is None or battery.function == _AVIONICS
    return 2.0 if unknown or battery.remaining is None else battery.remaining


def fraction(percent: int) -> float | None:
    """Return a percentage as a fraction; None if it is not one."""
    return percent / 100 if 0 <= percent <= 100 else None
