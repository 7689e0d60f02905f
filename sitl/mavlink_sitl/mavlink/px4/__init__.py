"""PX4's MAVLink side: its answers, texts and streams, per link."""
