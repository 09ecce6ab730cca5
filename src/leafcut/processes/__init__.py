"""Processes: one package for each kind of work. The module `course` runs them all."""
