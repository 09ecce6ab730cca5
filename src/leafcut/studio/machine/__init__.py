"""The one machine that the studio speaks to: its connection, its state, and the program that it runs."""
