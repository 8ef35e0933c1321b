"""What keeps the service in sight: metrics, logs, traces, readiness, and leaving without a loss."""
