"""How molecules lie on a cell; one module a law. None imports compiled code: `mpad check` makes them too."""
