"""Import controller settings into machine profiles: one module per kind of file."""
