"""Means of pictures over batches of samples with independent seeds, and how sure they are."""

import numpy as np

BLOCK = 16


def blocks(image):
    """Means of BLOCK x BLOCK pixels; what is left over at the right and bottom makes smaller blocks."""
    height, width = image.shape[:2]
    return np.array([[image[y:y + BLOCK, x:x + BLOCK].mean(axis=(0, 1)) for x in range(0, width, BLOCK)]
                     for y in range(0, height, BLOCK)])


class Estimate:
    """Each batch counts the same. Neighbouring pixels share samples, so blocks have an error of their own."""

    def __init__(self):
        self.count, self.sum, self.squares, self.block_means = 0, 0.0, 0.0, []

    def add(self, image):
        self.count += 1
        self.sum = self.sum + image.astype(np.float64)
        self.squares = self.squares + image.astype(np.float64) ** 2
        self.block_means.append(blocks(image))

    @property
    def mean(self):
        return self.sum / self.count

    @property
    def error(self):
        """Standard error of the mean of each pixel."""
        variance = np.maximum(self.squares / self.count - self.mean ** 2, 0) * self.count / (self.count - 1)
        return np.sqrt(variance / self.count)

    @property
    def block_error(self):
        return np.std(self.block_means, axis=0, ddof=1) / np.sqrt(self.count)

    @property
    def whole_error(self):
        """Standard error of the mean over all pixels and colours."""
        return np.std([means.mean() for means in self.block_means], ddof=1) / np.sqrt(self.count)

    def arrays(self, name):
        return {f"{name}_mean": self.mean, f"{name}_error": self.error, f"{name}_block_error": self.block_error,
                f"{name}_whole_error": self.whole_error}


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))
