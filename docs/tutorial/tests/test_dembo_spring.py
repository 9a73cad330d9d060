from mpad_core.testing import BondModelContract
from mpad_dembo_spring import DemboSpring


class TestDemboSpring(BondModelContract):
    model = DemboSpring(unstressed_rate=2.0, transition_stiffness=9.8e4, stiffness=1e5, rest_length=0.03, kT=4.11e-3)
