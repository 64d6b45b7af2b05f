"""MeshCone's engine: guided mesh refinement by second-order cone programming.

Importing this package is cheap on purpose. The engine's public face is
:mod:`meshcone.verbs.refine` and :mod:`meshcone.verbs.measure`; import them where they are used.
"""
