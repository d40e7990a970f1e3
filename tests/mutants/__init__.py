"""Lines of the product to break on purpose, and the tests of which one has to notice."""

from mutants.animation import ANIMATION
from mutants.claims import CLAIMS
from mutants.mutants import MUTANTS, Mutant
from mutants.recording import RECORDING

ALL: tuple[Mutant, ...] = (*ANIMATION, *CLAIMS, *MUTANTS, *RECORDING)
