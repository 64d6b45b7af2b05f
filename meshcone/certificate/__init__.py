"""The certificate: making it, storing it, and the optimum as a file stores it."""
