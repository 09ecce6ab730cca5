"""One file for each kind of work that `api.optimize` does; here, and in `api`, the rooms are joined."""
