"""Whole files, schema numbers, plug-ins, and the files of the user."""
