"""Write files atomically, check schema numbers, load plug-ins, and access the user's own files."""
