"""The proof of a rewritten program: it does the same work as the original."""
