"""What keeps a vehicle out of harm: targets, fences, battery, brake, late setpoints."""
