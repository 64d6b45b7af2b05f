"""From an uploaded form to a queued job."""
