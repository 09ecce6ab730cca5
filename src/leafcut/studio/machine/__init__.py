"""Connection to the machine, its state, and the running program."""
