"""Trained generators, their backends, and the models shipped with tfscope."""
