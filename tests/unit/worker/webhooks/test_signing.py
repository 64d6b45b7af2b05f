"""How webhooks prove who sends them."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
from datetime import UTC, datetime

import pytest
from standardwebhooks import Webhook, WebhookVerificationError

from meshcone.errors import InputError
from meshcone.settings import load_settings
from worker.jobs.outbox import Message
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
