"""Results that the library returns: the results of `model`, with methods that describe, show and save them."""
