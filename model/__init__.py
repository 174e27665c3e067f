"""Volumes, rendering, training and the generator; independent of Qt."""
