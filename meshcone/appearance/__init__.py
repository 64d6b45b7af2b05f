"""What colour surfaces have, and how different two of them look."""
