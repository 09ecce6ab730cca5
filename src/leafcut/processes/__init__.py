"""Processes: what belongs to one kind of work lies together; `course` is what they share."""
