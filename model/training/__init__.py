"""Training of generators in one resumable run."""
