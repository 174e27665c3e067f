"""Renderers: the ground truth that the generator learns from."""
