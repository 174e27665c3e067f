"""Rendered samples: drawn at random, stored, and rendered in parallel."""
