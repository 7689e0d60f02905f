"""The navigation server: nodes, action servers, services and topics."""
