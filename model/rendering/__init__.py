"""Renderers, which provide ground truth and training images."""
