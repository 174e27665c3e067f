"""Networks that sample a learned 3-D grid of features."""
