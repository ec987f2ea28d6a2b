"""A hypothesis about the stable region of Tables 5-4 and 5-7: the original code kept one of the two 1/τ of the belief update (3-11)."""

import numpy

import claims
from results import thesis

RADIUS, TRACK = 0.098, 0.5621  # m, Table C-1


def dynamics(gains, tau, kept):
    """A of dμ̃/dt = A μ̃ + b for tau, with 1/kept in the transposed factor of E' Π_μ E."""
    orders = gains['orders'] + 1
    sensory_map = numpy.array([[0, 0, 1], [1, 0, -TRACK / 2], [1, 0, TRACK / 2]]) / numpy.array([[1], [RADIUS], [RADIUS]])
    shift = numpy.kron(numpy.eye(orders, k=1), numpy.eye(3))
    error, factor = (shift + numpy.eye(3 * orders) / t for t in (tau, kept))
    state = numpy.kron(numpy.diag(1 / numpy.array(gains['state_variances'][:orders])), numpy.eye(3))
    sensory = numpy.kron(numpy.diag(1 / numpy.array(gains['sensory_variances'][:orders])), sensory_map.T @ sensory_map)
    return shift - gains['kappa_mu'] * (factor.T @ state @ error + sensory)


def smallest_tau(gains, rate):
    """Smallest tau [s] at which a step of forward Euler at a rate [Hz] with one 1/tau kept has a spectral radius below 1."""
    return thesis.search_limit(gains['tau'], thesis.LEAST, lambda tau: max(abs(numpy.linalg.eigvals(
        numpy.eye(3 * (gains['orders'] + 1)) + dynamics(gains, tau, gains['tau']) / rate))) < 1.0)


def limits(results):
    """(rate [Hz], the thesis' smallest tau, ours with one 1/tau kept, ours as printed) [s]."""
    gains = results.config('standard')['controller']
    return [(rate, theirs, smallest_tau(gains, rate), printed) for rate, printed, theirs in claims.limits(results, 'tau')]


def section(results):
    """The table."""
    return [{'belief update': f'{rate:g} Hz', 'thesis': f'{theirs:g}', 'one 1/τ kept at 1/0.03': f'{kept:.2g}', 'as printed': f'{printed:.2g}'}
            for rate, theirs, kept, printed in limits(results)]
