"""A job's whole state: both the front end and the workers change it here, and nowhere else."""
