"""What reports say and draw of a sheet."""
