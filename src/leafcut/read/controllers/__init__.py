"""Import controller settings into machine profiles. Each kind of settings file has its own module."""
