"""Jobs of the studio: requests that run in other processes, and their history."""
