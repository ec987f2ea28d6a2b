"""Draws by seed: the generator and the distributions with which C++ drew the robots of earlier figures (std::mt19937_64)."""

import jackal_aic._core


class Draws:
    """Independent of platform and library: a seed means the same robot everywhere."""

    def __init__(self, seed):
        self.word = jackal_aic._core.Generator(seed)  # a call: 64 random bits

    def between(self, low, high):
        """Of 53 bits."""
        return low + (high - low) * float(self.word() >> 11) * 2.0**-53

    def below(self, count):
        """A whole number from 0 to count - 1."""
        return self.word() % count

    def one_of(self, values):
        return values[self.below(len(values))]

    def sign(self):
        return 1.0 if self.below(2) == 0 else -1.0
