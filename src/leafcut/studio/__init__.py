"""The studio: a page on this machine that opens a file, shows it, runs, and hands over the program."""
