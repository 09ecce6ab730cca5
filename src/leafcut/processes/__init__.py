"""Processes: one package for each type of work. The module `course` runs a job for any process."""
