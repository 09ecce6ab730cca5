"""Material removal: swept areas, engagement and step-over, for planning and verification."""
