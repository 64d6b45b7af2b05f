"""MeshCone's engine: guided mesh refinement by second-order cone programming.

Importing this package is cheap on purpose. The engine's public face is
:mod:`meshcone.refine` and :mod:`meshcone.measure`; import them where they are used.
"""
