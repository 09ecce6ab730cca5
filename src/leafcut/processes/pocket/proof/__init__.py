"""The proof of a pocketing program: read back and simulated."""
