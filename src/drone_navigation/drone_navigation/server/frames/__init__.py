"""The frames that `/tf` and `/tf_static` join."""
