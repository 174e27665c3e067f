"""Training of both stages in one resumable run."""
