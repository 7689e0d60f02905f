"""Messages that server and clients fill in alike."""
