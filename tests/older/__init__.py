"""What makes the workers of a test older than the program; see its sitecustomize."""
