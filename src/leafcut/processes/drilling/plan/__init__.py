"""Planning of drilling: tools and depths of the holes, and the toolpath of an order."""
