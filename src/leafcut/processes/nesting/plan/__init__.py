"""Planning of nests: which part lies where on which sheet."""
