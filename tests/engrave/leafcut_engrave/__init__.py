"""A process from outside: the lines of a drawing, engraved at one depth."""
