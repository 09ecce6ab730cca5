"""Results that the library returns: results of `model` with methods to describe, show and save them."""
