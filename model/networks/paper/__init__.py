"""The paper's two networks."""
