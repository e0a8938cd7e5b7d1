"""Pictures with times as videos."""
