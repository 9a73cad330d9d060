"""What is measured on cells that roll: from runs and from tracks of experiments, by the same functions."""
