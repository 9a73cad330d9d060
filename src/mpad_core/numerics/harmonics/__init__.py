"""Many spheres by vector harmonics about each: couplings in closed form, wall by images, lubrication, GMRES."""
