"""Processes: one package for each kind of work; `course` runs them all."""
