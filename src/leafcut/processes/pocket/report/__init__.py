"""What reports say and draw of pockets."""
