"""How a vehicle is led along its path: trajectories, setpoints, obstacles."""
