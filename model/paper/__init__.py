"""What the paper's figures and tables show, computed for any model of the paper's kind."""
