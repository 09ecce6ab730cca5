"""Results of the library: subclasses of the model's results that can describe, show and save themselves."""
