"""What a tool removes: swept areas, engagement and step-over; used by planning and by proof, made by neither."""
