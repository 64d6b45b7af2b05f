"""Where files may come from and go to: what a job may name, whatever it asks for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from meshcone.errors import InputError
from meshcone.text import is_line
from worker.outbound.addresses import URL_LENGTH, require_url

if TYPE_CHECKING:
    from worker.transfers.settings import TransferSettings

_BUCKETS = "s3://"


def is_in_bucket(url: str) -> bool:
    """Whether a URL names an object of a bucket."""
    return url.startswith(_BUCKETS)


def require_source(
    url: str, what: str, settings: TransferSettings, authorization: str | None = None
) -> None:
    """Refuse a URL from which this installation would fetch nothing.

    Args:
        url: what a stranger has sent.
        what: what to call it in messages.
        settings: the installation's.
        authorization: the name of the secret to show there, if any.

    Raises:
        InputError: the URL cannot be used, is of a bucket that is not allowed, or may not be
            shown the secret.
    """
    if is_in_bucket(url):
        object_of(url, what, settings.fetch_buckets, "MESHCONE_FETCH_BUCKETS")
    _require_place(url, what, settings, authorization)


def require_target(
    url: str, what: str, settings: TransferSettings, authorization: str | None = None
) -> None:
    """Refuse a URL at which this installation would put nothing; as :func:`require_source` does."""
    if is_in_bucket(url):
        object_of(url, what, settings.output_buckets, "MESHCONE_OUTPUT_BUCKETS")
    _require_place(url, what, settings, authorization)


def _require_place(
    url: str, what: str, settings: TransferSettings, authorization: str | None
) -> None:
    if is_in_bucket(url):
        if authorization is not None:
            raise InputError(f"{what} is in a bucket, which takes no 'authorization'")
        return
    require_url(url, what, private_addresses=settings.transfer_private_addresses)
    if authorization is not None:
        secret_for(url, authorization, settings)


def secret_for(url: str, name: str, settings: TransferSettings) -> str:
    """The secret of a name, which is told to its own host alone, by https.

    One whose host is written with ``http://`` is told by http, and only so.

    Raises:
        InputError: there is none of that name, or it is another host's.
    """
    found = settings.transfer_authorizations.get(name)
    if found is None:
        raise InputError(
            f"this installation has no authorization '{name}' (MESHCONE_TRANSFER_AUTHORIZATIONS)"
        )
    parts = urlsplit(url)
    host = parts.netloc.lower()
    place = host if parts.scheme == "https" else f"{parts.scheme}://{host}"
    if found.host != place:
        raise InputError(f"the authorization '{name}' is not for {parts.scheme}://{host}")
    return found.value


def object_of(url: str, what: str, allowed: Sequence[str], setting: str) -> tuple[str, str]:
    """The allowed prefix that an object is below, and the rest of its key.

    Args:
        url: of the object.
        what: what to call it in messages.
        allowed: the prefixes.
        setting: that has them.

    Raises:
        InputError: it is below none, or its key is no plain path.
    """
    path = url.removeprefix(_BUCKETS)
    if len(url) > URL_LENGTH or not is_line(path):
        raise InputError(f"{what} must be one line of up to {URL_LENGTH} characters")
    if any(part in ("", ".", "..") for part in path.split("/")):
        raise InputError(f"{what} must name an object, as s3://bucket/key, without '..'")
    for prefix in allowed:
        if url.startswith(f"{prefix}/"):
            return prefix, url.removeprefix(f"{prefix}/")
    raise InputError(f"{what} is in no bucket that this installation lets jobs use ({setting})")


def last_name(url: str) -> str:
    """The last part of a URL's path, decoded; empty where the path has none."""
    path = url if is_in_bucket(url) else unquote(urlsplit(url).path)
    return path.replace("\\", "/").rpartition("/")[2]


def host_of(url: str) -> str:
    """What to call the place of a URL in messages and logs: never its path or its query."""
    parts = urlsplit(url)
    return f"{_BUCKETS}{parts.netloc}" if is_in_bucket(url) else parts.hostname or "the server"
