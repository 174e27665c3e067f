"""The editor of the opacity and colour transfer functions."""
