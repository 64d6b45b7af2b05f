"""Decoders of compressed geometry at arm's length, in a process that is bounded and may die."""

from meshcone.assets.gltf.decoding.process import Blob, decode

__all__ = ["Blob", "decode"]
