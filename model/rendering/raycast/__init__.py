"""The ray caster: Numba functions for CPU threads and CUDA, and what drives them."""
