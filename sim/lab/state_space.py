"""The thesis' controller on a point mass without dynamics (chapter 4 and Appendix A): y = a, g(mu) = mu.

With the state x = (mu, mu', ..., mu^(p), a, a', ..., a^(p)), dx/dt = A x + B mu_d (4-7):

    A = [ D - k_mu E' Pi_mu E - k_mu Pi_y     k_mu Pi_y ]     B = [ k_mu E' Pi_mu e_0 / tau ]     E = D + I/tau
        [ k_a Pi_y                           -k_a Pi_y  ]         [ 0                       ]

Where the print is damaged or contradicts itself: Pi = 1/Sigma, as in 4-3. The unprinted `tau_mat` of Appendix A is E', which also
gives its B. Each order has an action, as in 4-6; the controller that drives a robot has the one of order 0.
"""

import numpy


def state_space_model(gains):
    """A, shape (2(p+1), 2(p+1)), and B of the gains of a thesis controller (keys of controller.*)."""
    orders, kappa_mu = gains['orders'] + 1, gains['kappa_mu']
    pi_mu, pi_y = (numpy.diag(1.0 / numpy.array(gains[key][:orders])) for key in ('state_variances', 'sensory_variances'))
    shift = numpy.eye(orders, k=1)
    error = shift + numpy.eye(orders) / gains['tau']
    a = numpy.block([[shift - kappa_mu * (error.T @ pi_mu @ error + pi_y), kappa_mu * pi_y],
                     [gains['kappa_a'] * pi_y, -gains['kappa_a'] * pi_y]])
    return a, numpy.append(kappa_mu / gains['tau'] * (error.T @ pi_mu)[:, 0], numpy.zeros(orders))


def step_response(gains, set_point, duration):
    """Time [s], output [m/s] and belief [m/s] by forward Euler at the rate of the belief; not finite if it diverges."""
    a, b = state_space_model(gains)
    step = 1.0 / gains['belief_rate']
    states = numpy.zeros((int(round(duration / step)), len(b)))
    for now, after in zip(states, states[1:]):
        after[:] = now + step * (a @ now + b * set_point)
    return step * numpy.arange(len(states)), states[:, len(b) // 2], states[:, 0]
