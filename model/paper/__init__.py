"""The paper's figures and tables, computed for any model of the paper's kind."""
