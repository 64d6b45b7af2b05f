"""What the engine does with files, one verb a module."""
