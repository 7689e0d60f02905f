"""The vehicle's own fence, from its parameters, in the map frame. No ROS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mavlink_vehicle.profiles import Profile
from navigation_core.fences import Area, Circle, Fence
from navigation_core.geometry import Vector3

# Bits of FENCE_TYPE (AC_Fence.h).
_ALTITUDE_MAX, _CIRCLE, _POLYGON, _ALTITUDE_MIN = 1, 2, 4, 8
# FENCE_OPTIONS bit 1: one of the inclusions is enough.
_UNION = 2
NO_FENCE = Fence()


def fence_of(
    profile: Profile,
    parameters: Mapping[str, float],
    home_enu_m: Vector3 | None,
    areas: tuple[Area, ...] = (),
) -> Fence | None:
    """Return the fence that the vehicle keeps to, or None while it is not known.

    Args:
        profile: the vehicle's.
        parameters: what was read of its `wanted_parameters`.
        home_enu_m: the launch point, from which the fence's circle and heights count.
        areas: circles and polygons that were uploaded to it.
    """
    if "GF_ACTION" in profile.wanted_parameters:
        return _px4(parameters, home_enu_m, areas)
    if "FENCE_ENABLE" in profile.wanted_parameters:
        return _ardupilot(parameters, home_enu_m, areas)
    return NO_FENCE


def _circle(home_enu_m: Vector3, radius_m: float) -> Circle:
    return Circle((home_enu_m[0], home_enu_m[1]), radius_m, name="circle about home")


def _sorted(areas: Sequence[Area], union: bool) -> tuple[list[Area], tuple[Area, ...]]:
    """Part uploaded areas into those that all count and those of which one is enough."""
    alternatives = [area for area in areas if union and area.inclusion]
    return [area for area in areas if area not in alternatives], tuple(alternatives)


def _ardupilot(
    parameters: Mapping[str, float], home_enu_m: Vector3 | None, areas: tuple[Area, ...]
) -> Fence | None:
    if "FENCE_ENABLE" not in parameters:
        return None
    # With FENCE_AUTOENABLE it comes into force by itself with arming or the take-off.
    if not parameters["FENCE_ENABLE"] and not parameters.get("FENCE_AUTOENABLE"):
        return NO_FENCE
    if home_enu_m is None:
        return None
    kinds = int(parameters.get("FENCE_TYPE", 0))
    union = bool(int(parameters.get("FENCE_OPTIONS", 0)) & _UNION)
    found, alternatives = _sorted(areas if kinds & _POLYGON else (), union)
    radius_m = parameters.get("FENCE_RADIUS")
    if kinds & _CIRCLE and radius_m is not None:
        found.append(_circle(home_enu_m, radius_m))
    return Fence(
        areas=tuple(found),
        alternatives=alternatives,
        altitude_min_m=parameters.get("FENCE_ALT_MIN") if kinds & _ALTITUDE_MIN else None,
        altitude_max_m=parameters.get("FENCE_ALT_MAX") if kinds & _ALTITUDE_MAX else None,
    )


def _px4(
    parameters: Mapping[str, float], home_enu_m: Vector3 | None, areas: tuple[Area, ...]
) -> Fence | None:
    if "GF_ACTION" not in parameters:
        return None
    if not parameters["GF_ACTION"]:  # a breach has no consequence
        return NO_FENCE
    radius_m = parameters.get("GF_MAX_HOR_DIST", 0.0)
    height_m = parameters.get("GF_MAX_VER_DIST", 0.0)
    if (radius_m > 0.0 or height_m > 0.0) and home_enu_m is None:
        return None
    found, alternatives = _sorted(areas, union=True)
    if radius_m > 0.0 and home_enu_m is not None:
        found.append(_circle(home_enu_m, radius_m))
    return Fence(
        areas=tuple(found),
        alternatives=alternatives,
        altitude_max_m=height_m if height_m > 0.0 else None,
    )
