"""Common cuts: parts share the cut along edges that are a kerf apart, or that coincide without compensation."""
