"""CDL-BIEM by low-order boundary elements, the discretisation of King and Hammer (2001)."""
