"""Nesting: drawings and quantities become sheets with parts laid close together."""
