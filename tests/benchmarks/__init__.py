"""Measurements behind the documents' tables: ``python -m tests.benchmarks.NAME``."""
