"""The Python client of the API."""

from service.client.client import Client, ServiceError

__all__ = ["Client", "ServiceError"]
