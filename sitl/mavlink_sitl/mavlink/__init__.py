"""The server side of each MAVLink service, sans-IO: messages in, messages out."""
