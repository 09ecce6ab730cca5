"""Server of the studio: access, routes, start and end."""
