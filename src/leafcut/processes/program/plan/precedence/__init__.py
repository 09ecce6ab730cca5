"""Precedence in a program: which piece of work must come before which, and why pieces stay."""
