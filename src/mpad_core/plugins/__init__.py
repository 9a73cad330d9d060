"""How a part is found: by name through entry points, loaded only when a scene names it."""
