"""The Python client of the API."""

from service.api.request_schemas import LinkedFile, OutputPlace
from service.client.client import Client
from service.client.transport import ServiceError

__all__ = ["Client", "LinkedFile", "OutputPlace", "ServiceError"]
