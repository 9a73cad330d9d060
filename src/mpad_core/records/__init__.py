"""What remains of a run: trajectory, checkpoint, and the lock on their directory."""
