"""The broker: the embedded server, connections to any, and waiting for one that is away."""
