"""Results that the library returns: the results of `model`, with methods to describe, show and save them."""
