"""``python -m service.cli`` is ``meshcone``."""

from service.cli import app

app()
