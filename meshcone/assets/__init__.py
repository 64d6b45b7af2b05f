"""Files and the surfaces in them."""

from meshcone.assets.base import Asset
from meshcone.assets.counts import AssetCounts
from meshcone.assets.limits import Limits
from meshcone.assets.policy import WritePolicy
from meshcone.assets.reader import read_asset

__all__ = ["Asset", "AssetCounts", "Limits", "WritePolicy", "read_asset"]
