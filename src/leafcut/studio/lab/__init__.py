"""The lab: experiments, their view, and their routes."""
