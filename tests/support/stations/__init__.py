"""Ground stations, and the missions and vehicles that they are tried on."""
