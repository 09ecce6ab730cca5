"""The studio: a web page on this machine that shows the work, runs it and hands out the program."""
