"""MAVFTP: the files of a vehicle, stored ones and those that are made when they are read."""
