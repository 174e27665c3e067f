"""The ray caster: Numba kernels for CPU threads and CUDA, and the renderer that runs them."""
