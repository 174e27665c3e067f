"""The paper's opacity and translation GANs."""
