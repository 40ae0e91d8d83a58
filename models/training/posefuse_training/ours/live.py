"""Recipe of the causal model; see `learning`."""

from . import learning
from .causal import Causal

KIND, BEFORE, AFTER = "live", Causal.BEFORE, Causal.AFTER
ABOUT = {
    "summary": "Causal: a network that weighs simple continuations and the guesses of hidden joints, and corrects them.",
    "source": "ours",
}

arguments, train, load = learning.recipe(Causal)
