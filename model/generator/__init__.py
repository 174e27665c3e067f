"""Trained generators, what runs them, and those that ship."""
