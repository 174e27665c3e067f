"""Sensitivities of images to edits of the opacity transfer function."""
