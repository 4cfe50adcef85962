"""The shipped missions: those of the two papers, those of the world as it is, and those whose results are held to the last bit."""

from ltlplan.missions import shipped_missions

PAPER_MISSIONS = ("firefighting", "hoops-ltl", "hoops-published", "hoops-sequence")
WORLD_MISSIONS = tuple(name for name in shipped_missions() if name not in PAPER_MISSIONS)
GOLDEN_MISSIONS = (*PAPER_MISSIONS, "meeting")
