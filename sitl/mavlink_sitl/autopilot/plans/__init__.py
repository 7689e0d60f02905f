"""What people upload: missions, fences, rally points."""
