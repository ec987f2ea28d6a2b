"""Draws by seed: the generator and the distributions with which C++ drew the robots of earlier figures (std::mt19937_64)."""

_SIZE, _MIDDLE, _WORD = 312, 156, (1 << 64) - 1


class Draws:
    """Independent of platform and library: a seed means the same robot everywhere."""

    def __init__(self, seed):
        self._state = [seed & _WORD]
        for i in range(1, _SIZE):
            last = self._state[-1]
            self._state.append((6364136223846793005 * (last ^ (last >> 62)) + i) & _WORD)
        self._index = _SIZE

    def _twist(self):
        x = self._state
        for i in range(_SIZE):
            y = (x[i] & 0xFFFFFFFF80000000) | (x[(i + 1) % _SIZE] & 0x7FFFFFFF)
            x[i] = x[(i + _MIDDLE) % _SIZE] ^ (y >> 1) ^ (0xB5026F5AA96619E9 if y & 1 else 0)
        self._index = 0

    def word(self):
        """64 random bits."""
        if self._index == _SIZE:
            self._twist()
        x = self._state[self._index]
        self._index += 1
        x ^= (x >> 29) & 0x5555555555555555
        x ^= (x << 17) & 0x71D67FFFEDA60000
        x ^= (x << 37) & 0xFFF7EEE000000000
        return x ^ (x >> 43)

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
