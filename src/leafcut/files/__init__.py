"""Atomic file output, schema numbers, plug-ins, and the user's files."""
