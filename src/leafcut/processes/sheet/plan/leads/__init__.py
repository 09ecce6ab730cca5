"""Leads and pierces: where each cut begins, how the torch comes to it and leaves it."""
