"""The paper's tables and figures beside ours: many seeds, every method on the same data.

In: the paper's robot and its printed numbers. Out: a Reproduction, CSV tables, PNG figures and one HTML page.
Question: which of the paper's results come out again, and how much do they depend on what it leaves open?

experiment     the closed loop of section 4
estimators     the methods
trials         one seed of the experiment, every method on it
tables         statistics over the seeds beside the paper's numbers
choices        what the paper leaves open, and how much the tables depend on it
record         the result
reproduce      all seeds on all cores, assembled and written
charts         the tables as charts
paper_figures  Figures 2 to 6
figures        all pictures of a result
sentences      findings as sentences
table_text     head and rows of the tables
gallery        one self-contained HTML page
files          tables, figures and page on disk
results_text   tables and findings on the terminal
"""

from wheelpend.reproduction.record import Reproduction
from wheelpend.reproduction.reproduce import REPRODUCTION_PARTS, run
from wheelpend.reproduction.results_text import print_reproduction

__all__ = ["REPRODUCTION_PARTS", "Reproduction", "print_reproduction", "run"]
