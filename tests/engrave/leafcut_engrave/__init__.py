"""A process from outside: engrave the lines of a drawing at one depth."""
