"""Benchmarks of speed and accuracy on this machine."""
