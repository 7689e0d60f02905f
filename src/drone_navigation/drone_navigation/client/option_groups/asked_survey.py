"""The survey that a command line asks for."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from drone_navigation.client.option_groups.survey_options import SURVEY_FRAMES
from drone_navigation.client.option_groups.terrain_file import read_terrain
from navigation_bridge.goals.requests import AltitudeReference
from navigation_bridge.goals.surveys import Camera, SurveyRequest

__all__ = ["survey_request"]

_REFERENCES = (None, AltitudeReference.HOME, AltitudeReference.GROUND, AltitudeReference.AMSL)
_FRAMES = dict(zip(SURVEY_FRAMES, _REFERENCES, strict=True))
_MM, _PERCENT = 1e-3, 1e-2


def survey_request(options: argparse.Namespace) -> SurveyRequest:
    """Return what is to be computed.

    Raises:
        TerrainFileError: the file with the terrain cannot be used.
    """
    camera = None
    if options.camera is not None:
        width_mm, height_mm, focal_mm = options.camera
        side, front = options.overlap
        camera = Camera(
            _MM * width_mm, _MM * height_mm, _MM * focal_mm, _PERCENT * side, _PERCENT * front
        )
    return SurveyRequest(
        options.boundary,
        tuple(options.hole),
        _FRAMES[options.survey_frame],
        options.height,
        options.spacing,
        camera,
        math.radians(options.angle),
        options.entry,
        options.overrun,
        options.radius,
        **({"speed_m_s": options.speed} if options.speed else {}),
        terrain=None if options.terrain is None else read_terrain(Path(options.terrain)),
    )
