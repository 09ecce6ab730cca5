"""Lab: experiments, their view and their routes."""
