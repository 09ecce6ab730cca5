"""Jobs of the studio: requests that run in threads, and their history."""
