"""How steps follow each other: the march over outer steps, and the compiled burst within one."""
