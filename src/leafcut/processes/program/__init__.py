"""Programs of other CAMs: the same work, in an order that takes less time."""
