"""The rewriter: writes a program with its pieces of work in a new order, in its own words."""
