"""The jobs of the studio: what a person asks for, runs in threads, and the history of what was run."""
