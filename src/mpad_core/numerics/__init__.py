"""Mathematics without bodies: arrays in, arrays out.

Importing this package imports nothing; each module is imported by name, and only `compiled` and the modules that use it
bring in numba.
"""
