"""The validation suite: every contract over every installed part; `mpad validate` runs it, with pytest inside."""
