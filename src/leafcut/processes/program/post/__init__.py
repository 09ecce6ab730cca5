"""The rewriter: a program with its pieces of work in another order, in its own words."""
