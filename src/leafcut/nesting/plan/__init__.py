"""Planning of nests: the position of each part on its sheet."""
