"""Rules that end, hold or pause a goal, one file each. ``judge(snapshot, goal)`` never acts."""
