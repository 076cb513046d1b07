"""Results as lines and tables of the terminal, a file per result."""
