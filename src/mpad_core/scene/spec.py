"""What a scene says: frozen values, all in inner units (µm, s, pN, K).

Field names are the keys of the scene file; a field's metadata holds its unit and the line that documents it.
"""

# ruff: noqa: RUF009  # fields are declared by helpers, whose calls are attrs fields and no shared defaults

import math
from typing import Annotated, Any, Literal, TypeAlias

import attrs
from attrs import frozen

from mpad_core.plugins import registry
from mpad_core.units import quantity

Vector: TypeAlias = tuple[float, float, float]
Span: TypeAlias = tuple[float, float]
Switch: TypeAlias = Literal["auto", "on", "off"]
Recorded: TypeAlias = Literal["overlap", "velocity", "bonds", "capture_hazard"]
Measured: TypeAlias = Literal["dx", "x", "y", "z", "overlap", "caught"]

PART_KEYS = {"surface": "layout", "force": "law"}  # the key that names a part of this kind; elsewhere "name"
WATER = 1e-9  # pN s²/µm⁴ = 1000 kg/m³


@frozen
class Within:
    """A validator: a number, or each of several, must lie in a range; ``above`` leaves out its lower end."""

    low: float
    high: float
    above: bool = False

    def __call__(self, instance: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        """Raise ValueError for a value outside the range."""
        unit = attribute.metadata.get("unit", "")
        for number in value if isinstance(value, tuple) else (value,):
            if number is not None and not self._holds(number):
                start = "above" if self.above else "at least"
                limits = f"must be {start} {self.low:.15g} and at most {self.high:.15g} {unit}".rstrip()
                raise ValueError(f"{limits}, not {number:.15g} {unit}".rstrip())

    def _holds(self, number: float) -> bool:
        return self.low <= number <= self.high and not (self.above and number == self.low)


def _ordered(instance: object, attribute: "attrs.Attribute[Any]", value: Span) -> None:
    if value[0] > value[1]:
        raise ValueError(f"must go from the lower to the higher end, not from {value[0]:.15g} to {value[1]:.15g}")


def _measure(unit: str, *valid: Any, default: Any = attrs.NOTHING, doc: str) -> Any:
    """Declare a field that is a quantity within a range."""
    declared = quantity(unit, default=default, doc=doc)
    for validator in valid:
        declared.validator(validator)
    return declared


def _says(doc: str, *, default: Any = attrs.NOTHING, factory: Any = None, valid: Any = None, **more: Any) -> Any:
    """Declare a field that is not a quantity."""
    metadata = {"doc": doc, **more}
    if factory is not None:
        return attrs.field(factory=factory, validator=valid, metadata=metadata)
    return attrs.field(default=default, validator=valid, metadata=metadata)


_PLACE = Within(-1e7, 1e7)
_SITE_DENSITY = Within(0, 1e6)
_MASS_DENSITY = Within(0, 1e-7)
_ROUGHNESS = Within(0, 100)
_RATE = Within(0, 1e12)


@frozen
class Slot:
    """Marks where a scene names a part: its kind, and the part meant where the scene names none."""

    kind: str
    default: str | None = None


@frozen(kw_only=True)
class Part:
    """A part as the scene names it.

    ``parameters`` are complete (defaults included) and in inner units, but for those that the core fills.
    ``written`` keeps the text of parameters whose dimension only the text tells, ``origins`` where those of a preset
    come from.
    """

    kind: str
    name: str
    parameters: dict[str, Any] = attrs.field(factory=dict)
    written: dict[str, str] = attrs.field(factory=dict, eq=False, repr=False)
    origins: dict[str, str] = attrs.field(factory=dict, eq=False, repr=False)

    def build(self, **filled: Any) -> Any:
        """Make the part; what the core fills goes where the part has such a field and the scene is silent."""
        made = registry.load(self.kind, self.name)
        known = {field.alias for field in attrs.fields(made) if field.init}
        return made(**({name: value for name, value in filled.items() if name in known} | self.parameters))

    @property
    def instance(self) -> Any:
        """The part, made anew; for kinds of which the core fills no field."""
        return self.build()


@frozen(kw_only=True)
class Condition:
    """One way to stop: a cell's quantity (µm) passes a value. ``caught`` counts 0 or 1, and is written alone."""

    cell: str
    quantity: Measured
    op: Literal[">", "<"] = ">"
    value: float = 0.0

    def __str__(self) -> str:
        """Give the condition as a scene writes it."""
        start = f"{self.cell}.{self.quantity}"
        return start if self.quantity == "caught" else f"{start} {self.op} {self.value!r} um"


@frozen(kw_only=True)
class Stop:
    """When the run ends: at a time, or as soon as one condition holds."""

    time: float = _measure("s", Within(0, 1e7, above=True), doc="the run ends at this time at the latest")
    when: tuple[Condition, ...] = _says("conditions; the first that holds ends the run", default=())


@frozen(kw_only=True)
class Accuracy:
    """How exact a run is to be; the program picks its steps from these."""

    position: float = _measure("um", Within(0, 1, above=True), default=1e-4, doc="error of a position over one step")
    rate: float = _says("relative error of the rates of bond events", default=1e-3, valid=Within(0, 1, above=True))
    explicit: float = _measure(
        "s", Within(0, 1e-3), default=0.0, doc="step of explicit Euler, for comparison; 0: implicit, of any length"
    )


@frozen(kw_only=True)
class Fluid:
    """The fluid around the cells."""

    viscosity: float = _measure("pN s/um^2", Within(0, 1e6, above=True), doc="dynamic viscosity")
    density: float = _measure("pN s^2/um^4", _MASS_DENSITY, default=WATER, doc="mass density; matters under gravity")
    temperature: float = _measure("K", Within(0, 2000, above=True), default=298.0, doc="temperature")


@frozen(kw_only=True)
class Flow:
    """The ambient flow: none, or u = rate · z · x̂."""

    kind: Literal["none", "shear"] = _says('"shear" or "none"', default="none")
    rate: float = _measure("1/s", Within(0, 1e9), default=0.0, doc="shear rate")


@frozen(kw_only=True)
class Gravity:
    """The acceleration that cells feel, times their excess mass over the fluid."""

    acceleration: Vector = _measure(
        "um/s^2", Within(-1e12, 1e12), default=(0.0, 0.0, 0.0), doc="along x, y, z; z points away from the wall"
    )


@frozen(kw_only=True)
class Wall:
    """The plane z = 0, fluid above."""

    roughness: float = _measure("um", _ROUGHNESS, default=0.0, doc="thickness of the wall's roughness layer")
    sites: dict[str, Annotated[Part, Slot("surface")]] = _says("binding sites of the wall, by name", factory=dict)


@frozen(kw_only=True)
class CellSites:
    """One kind of binding site on cells."""

    layout: Literal["uniform", "microvilli", "clusters"] = _says("how sites lie on the cell", default="uniform")
    density: float = _measure("1/um^2", _SITE_DENSITY, doc="sites per area of the smooth sphere")
    tips: float | None = _measure("1/um^2", Within(0, 1e4), default=None, doc="microvilli per area")
    tip_radius: float | None = _measure("um", Within(0, 100, above=True), default=None, doc="radius of a tip")
    cluster_size: float | None = _says("mean number of sites in a cluster", default=None, valid=Within(1, 1e6))
    cluster_radius: float | None = _measure(
        "um", Within(0, 100, above=True), default=None, doc="standard deviation of a cluster in either direction"
    )


@frozen(kw_only=True)
class Kind:
    """What cells of one kind share."""

    radius: float = _measure("um", Within(1e-3, 1e3), doc="radius of the smooth sphere")
    density: float = _measure("pN s^2/um^4", _MASS_DENSITY, doc="mass density")
    roughness: float = _measure("um", _ROUGHNESS, default=0.0, doc="thickness of the cell's roughness layer")
    sites: dict[str, CellSites] = _says("binding sites of the cell, by name", factory=dict)


@frozen(kw_only=True)
class Start:
    """What happens before time zero."""

    rolling_alone: float = _measure(
        "s", Within(0, 1e6), default=0.0, doc="the cell first rolls alone for this long, then goes back to its x, y"
    )


_HEIGHT = "height of the centre above the wall (unbounded: its z); or overlap"
_OVERLAP = "height above the one where unstressed bonds just reach; or height"
_BINDS = "false: a probe, which forms no bonds"
_HELD = "true: kept where it is by force and torque"


@frozen(kw_only=True)
class Cell:
    """One cell, by name."""

    kind: str = _says("name of its kind")
    x: float = _measure("um", _PLACE, default=0.0, doc="place along the flow")
    y: float = _measure("um", _PLACE, default=0.0, doc="place across the flow")
    height: float | None = _measure("um", _PLACE, default=None, doc=_HEIGHT)
    overlap: float | None = _measure("um", _PLACE, default=None, doc=_OVERLAP)
    held: bool = _says(_HELD, default=False)
    binds: bool = _says(_BINDS, default=True)
    start: Start = _says("what happens before time zero", factory=Start)


@frozen(kw_only=True)
class Group:
    """Several cells of one kind, put at random into a rectangle."""

    kind: str = _says("name of their kind")
    number: int = _says("how many", valid=Within(1, 100_000))
    x: Span = _measure("um", _PLACE, _ordered, doc="from where to where along the flow")
    y: Span = _measure("um", _PLACE, _ordered, doc="from where to where across the flow")
    height: float | None = _measure("um", _PLACE, default=None, doc=_HEIGHT)
    overlap: float | None = _measure("um", _PLACE, default=None, doc=_OVERLAP)
    held: bool = _says(_HELD, default=False)
    binds: bool = _says(_BINDS, default=True)
    minimum_gap: float = _measure("um", Within(0, 1e4), default=0.0, doc="smallest gap between them at the start")


@frozen(kw_only=True)
class OnRate:
    """How fast bonds form, for one free site on a cell within reach of a wall of the given site density.

    Between cells, for one pair of molecules within reach.
    """

    value: float = _measure("1/s", _RATE, doc="on-rate")
    at_density: float | None = _measure(
        "1/um^2", Within(0, 1e6, above=True), default=None, doc="the wall's site density that it holds for"
    )


@frozen(kw_only=True)
class Encounter:
    """Encounter of molecules on surfaces that slip past each other, after Chang & Hammer (1999)."""

    radius: float = _measure("um", Within(0, 10, above=True), doc="radius of the disc in which molecules react")
    diffusivity: float = _measure("um^2/s", Within(0, 1e9, above=True), doc="of one molecule relative to the other")
    reaction_rate: float = _measure("1/s", Within(0, 1e15), doc="rate at which molecules in the disc react")


@frozen(kw_only=True)
class Bond:
    """One species of bond between a site of cells and a site of the wall or of other cells."""

    between: tuple[str, str] = _says("a site of cells, and a site of the wall or of other cells")
    model: Annotated[Part, Slot("bond")] = _says("the bond model: how fast a bond breaks, how hard it pulls")
    on_rate: OnRate = _says("how fast bonds form")
    length: float = _measure("um", Within(0, 10, above=True), doc="length of the unstressed bond")
    stiffness: float = _measure("pN/um", Within(0, 1e9, above=True), doc="spring constant of the bond")
    reach: Literal["overlap", "pairs", "boltzmann_gap"] = _says("which sites can bind", default="overlap")
    compression: Literal["slack", "linear"] = _says("whether a bond shorter than its length pushes", default="slack")
    encounter: Encounter | None = _says("how the on-rate grows with slip; left out: not at all", default=None)


@frozen(kw_only=True)
class Effects:
    """What is taken into account; auto lets the scene decide."""

    shear: Switch = _says("the ambient flow", default="auto")
    wall: Switch = _says("the wall's effect on the fluid", default="auto")
    gravity: Switch = _says("the cells' weight", default="auto")
    repulsion: Switch = _says("repulsion between roughness layers", default="auto")
    bonds: Switch = _says("bonds between cells and wall", default="auto")
    coupling: Switch = _says("cells feel each other through the fluid", default="auto")
    lubrication: Switch = _says("exact near-contact forces between cells", default="auto")
    thermal: Switch = _says("thermal motion of the cells", default="auto")


@frozen(kw_only=True)
class Every:
    """When a frame is recorded: whichever comes first."""

    time: float = _measure("s", Within(1e-9, 1e7), default=0.01, doc="a frame at least this often")
    dx: float | None = _measure("um", Within(1e-6, 1e7), default=None, doc="a frame for each such step in dx")


@frozen(kw_only=True)
class Caught:
    """When a cell counts as caught: bound without a break, and slow."""

    bound_for: float = _measure("s", Within(0, 1e6), default=0.1, doc="bound without a break for this long")
    slower_than: float = _says(
        "and slower than this fraction of the cell's own free-stream speed", default=0.1, valid=Within(0, 1, above=True)
    )


_ALL_RECORDED: tuple[Recorded, ...] = ("overlap", "velocity", "bonds", "capture_hazard")


@frozen(kw_only=True)
class Record:
    """What is kept of the run."""

    every: Every = _says("when a frame is recorded", factory=Every)
    what: tuple[Recorded, ...] = _says("what a frame holds besides positions", default=_ALL_RECORDED)
    observers: tuple[Annotated[Part, Slot("observer")], ...] = _says("parts that look at every frame", default=())
    caught: Caught = _says("when a cell counts as caught", factory=Caught)


@frozen(kw_only=True)
class Passage:
    """A study: one cell passes others, and is compared with its passage where they are not."""

    cell: str = _says("the cell that passes")
    past: tuple[str, ...] = _says("the cells that it passes", single=True)
    control: bool = _says("true: also run without the cells in past", default=True)
    seeds: int = _says("number of runs, with seeds counted up from the scene's", default=1, valid=Within(1, 100_000))
    also_on_rates: tuple[float, ...] = _measure(
        "1/s", _RATE, default=(), doc="further on-rates that the capture hazard is worked out for"
    )


@frozen(kw_only=True)
class Scene:
    """A complete scene."""

    title: str = _says("what the run is called", default="")
    seed: int = _says("seed of all random numbers", default=1, valid=Within(0, 2**63 - 1))
    solver: Annotated[Part, Slot("solver")] = _says("the mobility solver")
    stop: Stop = _says("when the run ends")
    accuracy: Accuracy = _says("how exact the run is to be", factory=Accuracy)
    fluid: Fluid = _says("the fluid")
    flow: Flow = _says("the ambient flow; left out: quiescent", factory=Flow)
    gravity: Gravity = _says("gravity; left out: none", factory=Gravity)
    wall: Wall | None = _says("the wall; left out: unbounded", default=None)
    kinds: dict[str, Kind] = _says("kinds of cells, by name")
    cells: dict[str, Cell] = _says("single cells, by name", factory=dict)
    groups: dict[str, Group] = _says("groups of cells, by name", factory=dict)
    bonds: dict[str, Bond] = _says("species of bonds, by name; left out: no adhesion", factory=dict)
    repulsion: Annotated[Part, Slot("force", default="electrostatic")] | None = _says(
        "repulsion between roughness layers; left out: none", default=None
    )
    effects: Effects = _says("what is taken into account", factory=Effects)
    record: Record = _says("what is kept of the run", factory=Record)
    passage: Passage | None = _says("a study of one cell passing others", default=None)
    provenance: dict[str, str] = _says("where values come from, by their dotted keys", factory=dict)

    def between_cells(self, bond: Bond) -> bool:
        """Tell whether a bond's second site is one of cells, not one of the wall."""
        return self.wall is None or bond.between[1] not in self.wall.sites

    def bonds_of(self, kind: str) -> dict[str, Bond]:
        """Give the species of bonds that cells of a kind can form with the wall."""
        able = {name: bond for name, bond in self.bonds.items() if bond.between[0] in self.kinds[kind].sites}
        return {name: bond for name, bond in able.items() if not self.between_cells(bond)}

    def zero_overlap_height(self, kind: str) -> float:
        """Give the height (µm) of overlap zero, where the longest unstressed bond just reaches; NaN where none can."""
        bonds = self.bonds_of(kind).values()
        if self.wall is None or not bonds:
            return math.nan
        shared = self.kinds[kind]
        return shared.radius + shared.roughness + self.wall.roughness + max(bond.length for bond in bonds)

    def height_of(self, cell: str | Cell | Group) -> float:
        """Give the height (µm) at which a cell, or each cell of a group, starts."""
        found = (self.cells | self.groups)[cell] if isinstance(cell, str) else cell
        if found.height is not None:
            return found.height
        return self.zero_overlap_height(found.kind) + (found.overlap or 0.0)

    def partner_of(self, cell: str) -> str | None:
        """Name the cell that dx of a cell is measured from; None: from the cell's own place at the start.

        It is the first that the passage's cell passes; without a passage, the first other cell of the scene.
        """
        first = self.passage.past if self.passage else ()
        return next((name for name in (*first, *self.cells) if name != cell), None)
