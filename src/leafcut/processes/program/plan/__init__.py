"""Planning of programs: what of a program can be reordered, and what must stay."""
