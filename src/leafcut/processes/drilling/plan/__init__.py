"""Planning of drilling: the tools and depths of the holes, and the toolpath for an order."""
