"""Base of all flight modes: each turns its situation into `Guidance`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Guidance, Motors, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander
    from mavlink_sitl.autopilot.personality import ModeSpec


class Mode:
    """A flight mode of one vehicle."""

    vehicle: Commander

    def __init__(self, vehicle: Commander, spec: ModeSpec) -> None:
        self.vehicle = vehicle
        self.spec = spec

    def enter(self) -> None:
        """Take over."""
        self.update()

    def update(self) -> None:
        """Run one step; called at the autopilot's rate, armed or not."""

    @property
    def position_controlled(self) -> bool:
        """Whether the horizontal position controller runs (base_mode GUIDED_ENABLED)."""
        return self.spec.position_controlled

    @property
    def taking_off(self) -> bool:
        """Whether EXTENDED_SYS_STATE says TAKEOFF."""
        return False

    @property
    def landing(self) -> bool:
        """Whether EXTENDED_SYS_STATE says LANDING, and landing ends in disarming."""
        return False

    @property
    def at_rest(self) -> bool:
        """Whether a vehicle that cannot tell by its height counts as landed in it."""
        return False

    @property
    def wanted_velocity_m_s(self) -> Vector | None:
        """The velocity, NED, that somebody has it fly at; None where there is none."""
        return None

    def ground_motors(self) -> Motors:
        """The permitted motor state while landed."""
        return Motors.IDLE

    def guide(self, guidance: Guidance) -> None:
        """Hand new guidance to the controllers."""
        self.vehicle.guide(guidance)

    def drive(self, guidance: Guidance) -> None:
        """The same, if it is new."""
        if guidance != self.vehicle.wanted:
            self.guide(guidance)

    def hold_guidance(self) -> Guidance:
        """Brake to a standstill and stay there, nose where it is."""
        return Guidance(
            motors=Motors.FLY,
            restart_xy=True,
            restart_z=True,
            limits=self.vehicle.navigator.limits(),
        )
