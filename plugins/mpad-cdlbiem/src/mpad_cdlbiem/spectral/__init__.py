"""The spectral discretisation: vector spherical harmonics, exact Galerkin."""
