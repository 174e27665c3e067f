"""Training in one resumable run."""
