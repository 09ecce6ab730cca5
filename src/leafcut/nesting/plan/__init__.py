"""Planning of nests: decide where each part lies on its sheet."""
