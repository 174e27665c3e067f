"""Latent codes of opacity TFs: sampling, map, browsing, and search."""
