"""What the user says: the scene, its file, and how it becomes a problem."""
