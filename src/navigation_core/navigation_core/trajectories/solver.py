"""The solver of profiles that is installed."""

from __future__ import annotations

from navigation_core.trajectories.profiles import Solver

__all__ = ["installed_solver"]


def installed_solver() -> Solver:
    """Return Ruckig, or what takes its place where it is not installed."""
    try:
        from navigation_core.trajectories import ruckig_solver  # noqa: PLC0415 - may be missing
    except ModuleNotFoundError:
        from navigation_core.trajectories import python_solver  # noqa: PLC0415

        return python_solver
    return ruckig_solver
