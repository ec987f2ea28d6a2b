"""Minimises a function within bounds."""

import numpy
import scipy.optimize


def descend(function, start, low, high, step, evaluations, tolerance=1e-4):
    """The best point that the simplex of Nelder and Mead finds from a start, and its value. step: first step in each direction."""
    start, low, high = (numpy.asarray(values, float) for values in (start, low, high))
    step = numpy.broadcast_to(step, start.shape)
    best = [numpy.clip(start, low, high), numpy.inf]

    def bounded(x):
        x = numpy.clip(x, low, high)
        value = function(x)
        if value < best[1]:
            best[:] = x, value
        return value

    simplex = numpy.vstack([start] + [start + numpy.where(start[i] + step[i] <= high[i], 1.0, -1.0) * step[i] * numpy.eye(len(start))[i]
                                      for i in range(len(start))])
    scipy.optimize.minimize(bounded, start, method='Nelder-Mead', options={
        'initial_simplex': simplex, 'maxfev': evaluations, 'xatol': tolerance, 'fatol': 1e-9})
    return best[0], best[1]
