"""The ray caster: Numba kernels for CPU threads, and the renderer that runs them."""
