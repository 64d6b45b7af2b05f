"""Strangers' meshes are read here, in processes that can be lost."""
