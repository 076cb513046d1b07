"""The paper's tables and figures beside ours: many seeds, every method on the same data, files to look at.

experiment  the closed loop of section 4
estimators  the methods
trials      many seeds on all cores
tables      statistics beside the paper's numbers
choices     what the paper leaves open, and how much the tables depend on it
figures     PNG pictures in the paper's arrangement
gallery     one self-contained HTML page
wording     findings as sentences, and the tables on the terminal
"""

from wheelpend.reproduction.record import Reproduction
from wheelpend.reproduction.reproduce import REPRODUCTION_PARTS, run
from wheelpend.reproduction.results_text import print_reproduction

__all__ = ["REPRODUCTION_PARTS", "Reproduction", "print_reproduction", "run"]
