"""All MAVLink messages and constants, as pymavlink generates them; `dialect.pyi` has the types."""

from pymavlink.dialects.v20.all import *  # noqa: F403
