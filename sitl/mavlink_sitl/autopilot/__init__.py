"""The firmware side: modes, arming checks, controllers, failsafes. No MAVLink, no clock."""
