"""Planning of drilling: which tools make which holes, how deep, and the toolpath in the order that was found."""
