"""Buffer views compressed with meshopt: EXT_meshopt_compression and KHR_meshopt_compression.

Source: the texts of both extensions in the Khronos glTF repository.
"""
