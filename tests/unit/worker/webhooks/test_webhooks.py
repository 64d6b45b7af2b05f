"""Where webhooks may go, and how they prove who sends them."""

from __future__ import annotations

import base64
import hashlib
import hmac
import ipaddress
import json
from datetime import UTC, datetime

import pytest
from standardwebhooks import Webhook, WebhookVerificationError

from meshcone.errors import InputError
from meshcone.settings import load_settings
from worker.jobs.outbox import Message
from worker.webhooks.addresses import is_public, require_webhook_url
from worker.webhooks.settings import WebhookSettings
from worker.webhooks.signing import signed_headers

SECRET = "whsec_" + base64.b64encode(bytes(range(32))).decode()
MESSAGE = Message(
    id="0192_succeeded_1",
    job="0192",
    state="succeeded",
    attempt=1,
    url="https://example.org/hook",
    owner=None,
    labels=("nightly",),
    at=datetime(2026, 1, 2, tzinfo=UTC),
)


@pytest.mark.parametrize(
    "address",
    [
        "127.0.0.1",
        "10.1.2.3",
        "172.16.0.1",
        "192.168.1.1",
        "169.254.169.254",  # metadata of cloud machines
        "100.64.0.1",
        "0.0.0.0",  # noqa: S104
        "224.0.0.1",
        "255.255.255.255",
        "::",
        "::1",
        "fe80::1",
        "fd00::1",
        "ff02::1",
        "::ffff:127.0.0.1",
        "::ffff:10.0.0.1",
        "64:ff9b::7f00:1",  # NAT64 of 127.0.0.1
        "2002:7f00:1::",  # 6to4 of 127.0.0.1
    ],
)
def test_an_address_that_is_not_public_is_known_as_such(address: str) -> None:
    assert not is_public(ipaddress.ip_address(address))


@pytest.mark.parametrize(
    "address", ["1.1.1.1", "93.184.215.14", "2606:4700::1111", "::ffff:1.1.1.1", "64:ff9b::101:101"]
)
def test_a_public_address_is_known_as_such(address: str) -> None:
    assert is_public(ipaddress.ip_address(address))


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("http://example.org/hook", "begins with https://"),
        ("ftp://example.org/hook", "begins with https://"),
        ("example.org/hook", "begins with https://"),
        ("https:///hook", "begins with https://"),
        ("https://user:word@example.org/", "user or a password"),
        ("https://example.org:port/", "no URL"),
        ("https://[::1/", "no URL"),
        ("https://example.org/#here", "fragment"),
        ("https://example.org/\r\nX: y", "ASCII"),
        ("https://example.org/" + "x" * 2048, "ASCII"),
        ("https://localhost/hook", "not a public one"),
        ("https://10.0.0.1/hook", "not a public one"),
        ("https://[::ffff:10.0.0.1]/hook", "not a public one"),
        ("https://169.254.169.254/latest", "not a public one"),
    ],
)
def test_a_webhook_that_could_not_be_sent_is_refused_with_its_job(url: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        require_webhook_url(url, private_addresses=False)


def test_a_closed_network_can_be_allowed() -> None:
    url = "http://10.0.0.1:8080/hook?job=1"

    assert require_webhook_url(url, private_addresses=True) == url


def test_a_receiver_can_verify_with_the_standards_library() -> None:
    body = MESSAGE.body()

    verified = Webhook(SECRET).verify(body, dict(signed_headers(MESSAGE, body, SECRET)))

    assert verified == {
        "type": "job.succeeded",
        "timestamp": "2026-01-02T00:00:00+00:00",
        "data": {
            "id": "0192",
            "state": "succeeded",
            "attempt": 1,
            "labels": ["nightly"],
            "path": "/v1/jobs/0192",
        },
    }


def test_the_signature_is_that_of_the_specification() -> None:
    body = MESSAGE.body()
    headers = signed_headers(MESSAGE, body, SECRET)

    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    digest = hmac.new(bytes(range(32)), signed, hashlib.sha256).digest()

    assert headers["webhook-signature"] == "v1," + base64.b64encode(digest).decode()


@pytest.mark.parametrize(
    ("secret", "said"),
    [
        ("whsec_" + 33 * "A", "cannot be decoded"),
        ("whsec_" + 37 * "A" + "=", "cannot be decoded"),
        ("whsec_" + 32 * "-", "cannot be decoded"),
        ("whsec_", "cannot be decoded"),
        (32 * "A", "cannot be decoded"),
        ("whsec_" + 28 * "A", "has 21"),
        ("whsec_" + base64.b64encode(bytes(65)).decode(), "has 65"),
    ],
)
def test_a_secret_nothing_can_be_signed_with_is_refused(
    monkeypatch: pytest.MonkeyPatch, secret: str, said: str
) -> None:
    monkeypatch.setenv("MESHCONE_WEBHOOK_SECRET", secret)

    with pytest.raises(InputError, match=f"MESHCONE_WEBHOOK_SECRET: .*{said}") as refusal:
        load_settings(WebhookSettings)

    assert "openssl rand" in str(refusal.value)


def test_a_refused_secret_is_not_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESHCONE_WEBHOOK_SECRET", "whsec_" + 33 * "A")

    with pytest.raises(InputError) as refusal:
        load_settings(WebhookSettings)

    assert "AAAA" not in str(refusal.value)


@pytest.mark.parametrize("size", [24, 25, 26, 32, 64])
@pytest.mark.parametrize("is_padded", [True, False])
def test_a_secret_of_the_specifications_length_signs(
    monkeypatch: pytest.MonkeyPatch, size: int, is_padded: bool
) -> None:
    text = base64.b64encode(bytes(range(size))).decode()
    spelled = text if is_padded else text.rstrip("=")
    monkeypatch.setenv("MESHCONE_WEBHOOK_SECRET", f"whsec_{spelled}")

    secret = load_settings(WebhookSettings).webhook_secret

    assert secret is not None
    body = MESSAGE.body()
    assert Webhook(bytes(range(size))).verify(body, dict(signed_headers(MESSAGE, body, secret)))


def test_a_changed_body_does_not_verify() -> None:
    body = MESSAGE.body()
    forged = json.dumps({**json.loads(body), "type": "job.failed"})

    with pytest.raises(WebhookVerificationError):
        Webhook(SECRET).verify(forged, dict(signed_headers(MESSAGE, body, SECRET)))
