"""Kinetics of single bonds for Bell's law: the rate of the unstressed bond and the reactive compliance."""

from mpad_core import Preset

_KING = "King & Hammer, PNAS 98:14919, 2001"
_ALON = "Alon et al., J Cell Biol 138:1169, 1997"
_SMITH = "Smith, Berg & Lawrence, Biophys J 77:3371, 1999"
_EVANS = "Evans et al., PNAS 98:3784, 2001, caption of the two barriers"


def _bell(off_rate: float, angstrom: float, source: str, *, read: bool = False) -> Preset:
    """Make a preset from k⁰ in 1/s and r₀ in Å."""
    return Preset(
        parameters={"off_rate": off_rate, "reactive_compliance": round(angstrom * 1e-4, 12)},
        source=source,
        provenance="published" if read else "recalled",
    )


PRESETS = {
    "p-selectin": _bell(2.0, 0.4, f"{_KING}: P-selectin and PSGL-1", read=True),
    "p-selectin-smith": _bell(2.4, 0.39, f"{_SMITH}: P-selectin and PSGL-1"),
    "p-selectin-alon": _bell(0.93, 0.40, "Alon, Hammer & Springer, Nature 374:539, 1995: P-selectin and PSGL-1"),
    "e-selectin": _bell(2.6, 0.18, f"{_SMITH}: E-selectin"),
    "e-selectin-alon": _bell(0.7, 0.3, f"{_ALON}: E-selectin, 0.3 to 0.4 angstrom"),
    "l-selectin": _bell(7.0, 0.24, f"{_ALON}: L-selectin"),
    "l-selectin-outer": _bell(3.0, 4.0, f"{_EVANS}: L-selectin and PSGL-1, outer", read=True),
    "l-selectin-inner": _bell(100.0, 0.6, f"{_EVANS}: L-selectin and PSGL-1, inner", read=True),
    "gpib-vwf": _bell(3.45, 0.16, "Doggett et al., Biophys J 83:194, 2002: GPIb-alpha and vWF-A1"),
    "gpib-vwf-platelet": _bell(5.47, 7.1, "platelet adhesive dynamics of Mody & King: GPIb-alpha and vWF-A1"),
}
