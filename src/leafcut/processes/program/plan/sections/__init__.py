"""Sections of a program: pieces of work that can be reordered, and the barriers between them."""
