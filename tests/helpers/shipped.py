"""The shipped missions: those of the two papers, whose results are held to the last bit, and those of the world as it is."""

from ltlplan.missions import shipped_missions

PAPER_MISSIONS = ("firefighting", "hoops-ltl", "hoops-published", "hoops-sequence")
WORLD_MISSIONS = tuple(name for name in shipped_missions() if name not in PAPER_MISSIONS)
