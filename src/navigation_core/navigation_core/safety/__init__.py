"""Safety checks: targets, fences, battery, brake, late setpoints."""
