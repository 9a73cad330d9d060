"""What a part must be: protocols and values; nothing here computes."""
