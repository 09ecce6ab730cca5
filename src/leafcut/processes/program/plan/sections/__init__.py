"""Sections of a program: its rows as pieces of work, and what divides them."""
