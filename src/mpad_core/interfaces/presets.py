"""Sets of parameters under a name, with where they come from."""

from collections.abc import Mapping
from typing import Any, Literal

from attrs import field, frozen, validators


@frozen(kw_only=True)
class Preset:
    """Parameters of a part that a scene may ask for by name, as ``model = { name = "bell", preset = "p-selectin" }``.

    A part offers them in a class variable ``presets``, a mapping from names to presets. What a scene gives beside the
    name of a preset goes before what the preset says.

    Attributes
    ----------
    parameters
        Values by key, as the scene names them, in inner units (µm, s, pN).
    source
        Who measured or used them, and where it is printed.
    provenance
        ``published``: read there. ``recalled``: attributed to it, and not checked.
    """

    parameters: Mapping[str, Any]
    source: str
    provenance: Literal["published", "recalled"] = field(validator=validators.in_(("published", "recalled")))
