"""Settings from environment variables, and one clear line where a variable cannot be used."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_settings import BaseSettings

from meshcone.errors import InputError

Settings = TypeVar("Settings", bound=BaseSettings)


def load_settings(settings_class: type[Settings], **overrides: Any) -> Settings:
    """Read settings from the environment, but for those given here.

    Raises:
        InputError: naming the first variable that cannot be used.
    """
    try:
        return settings_class(**overrides)
    except ValidationError as error:
        first = error.errors()[0]
        prefix = settings_class.model_config.get("env_prefix", "")
        variable = prefix + "_".join(str(part) for part in first["loc"]).upper()
        raise InputError(f"environment variable {variable}: {first['msg'].lower()}") from None
