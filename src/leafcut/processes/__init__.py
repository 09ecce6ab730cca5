"""Processes: one package per kind of work; `course` runs all of them."""
