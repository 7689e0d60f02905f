"""The vehicle as goals see it: what it can do, where it is, who else flies it."""
