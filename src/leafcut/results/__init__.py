"""Results of the library. They extend the results in `model` with methods to describe, show and save them."""
