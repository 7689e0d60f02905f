"""RC_CHANNELS_OVERRIDE and MANUAL_CONTROL to raw channels."""

from __future__ import annotations

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.state.pilot import CHANNELS, KEEP, released
from mavlink_sitl.mavlink.codec import Message

NO_AXIS = 32767
"""MANUAL_CONTROL: the receiver's stick counts"""


def overrides(message: Message) -> list[int]:
    """The first 16 channels of a RC_CHANNELS_OVERRIDE."""
    return [getattr(message, f"chan{i}_raw") for i in range(1, CHANNELS + 1)]


def of_manual_control(message: Message, vehicle: Commander) -> list[int]:
    """Channels for `Pilot.override`: y is roll or steering, x pitch, z throttle, r yaw.

    Forward is a low pulse of the pitch channel. A rover's throttle goes backwards, too; it takes
    no notice of x and r. A copter takes no notice of a message with a throttle below 0
    (`handle_manual_control_axes` of each).
    """
    drives = vehicle.personality.kind in ("rover", "boat")
    channels = [KEEP] * CHANNELS
    if message.z < 0 and vehicle.personality.kind == "copter":
        return channels
    axes = [("Roll", message.y, 1000, 2000)]
    if drives:
        axes += [("Throttle", message.z, 1000, 2000)]
    else:
        x = message.x if message.x == NO_AXIS else -message.x
        axes += [("Pitch", x, 1000, 2000), ("Throttle", message.z, 0, 1000)]
        axes += [("Yaw", message.r, 1000, 2000)]
    for axis, value, offset, span in axes:
        stick = vehicle.radio.calibration(axis)
        raw_us = stick.least + (stick.most - stick.least) * (value + offset) / span
        place, within = stick.channel - 1, 0.0 < raw_us < KEEP - 1
        channels[place] = int(raw_us) if value != NO_AXIS and within else released(place)
    return channels
