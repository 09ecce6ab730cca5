"""Machine control: the connection to a machine, its view, and its routes."""
