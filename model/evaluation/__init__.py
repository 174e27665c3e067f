"""Evaluation of trained generators."""
