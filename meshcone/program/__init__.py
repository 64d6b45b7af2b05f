"""The cone programs: objectives, constraint kinds, solving, and what is known of a solve.

Nothing is imported here, so that reading a report's types does not load the solvers.
"""
