"""Material removal: swept areas, engagement and step-over, shared by planning and proof."""
