"""Processes: one package for each kind of work. The module `course` runs a job of any process."""
