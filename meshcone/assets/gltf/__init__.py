"""glTF 2.0 and GLB: a reader that trusts no declared size, and a writer that patches in place.

Source: Khronos glTF 2.0 Specification (ISO/IEC 12113:2022).
"""

from meshcone.assets.gltf.asset import GltfAsset, read_glb, read_gltf

__all__ = ["GltfAsset", "read_glb", "read_gltf"]
