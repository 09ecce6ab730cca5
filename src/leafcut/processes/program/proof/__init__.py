"""Prove that a rewritten program does the same work as the original."""
