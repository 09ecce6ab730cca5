"""The server of the studio: access control, routes, startup and shutdown."""
