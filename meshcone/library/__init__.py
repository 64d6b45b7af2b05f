"""What ``import meshcone`` offers: the engine's verbs for a program or a notebook."""
