"""Recipe of the model for takes; see `learning`."""

from . import learning
from .two_sided import TwoSided

KIND, BEFORE, AFTER = "offline", TwoSided.BEFORE, TwoSided.AFTER
ABOUT = {
    "summary": "Two-sided, for takes: a network that weighs ways from where joints were hidden to where they are seen again, and corrects them.",
    "source": "ours",
}

arguments, train, load = learning.recipe(TwoSided)
