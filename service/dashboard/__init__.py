"""The pages people look at: jobs, one job, many jobs of one label, and the API's description."""
