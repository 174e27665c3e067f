"""Rendered samples: random inputs, stores, and parallel rendering."""
