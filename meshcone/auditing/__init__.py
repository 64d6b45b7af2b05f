"""What an asset is by itself, and what else changed against its reference."""
