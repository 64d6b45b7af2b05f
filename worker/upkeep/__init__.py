"""What goes on beside the workers: what a death left undone, and what is old."""
