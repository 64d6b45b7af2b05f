"""Geometry compressed with Draco: KHR_draco_mesh_compression.

Source: the extension's text in the Khronos glTF repository, and the Draco bitstream
specification, version 2.2.
"""
