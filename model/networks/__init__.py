"""Generator and discriminator networks, model checkpoints and input encoding."""
