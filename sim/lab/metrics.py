"""Figures of a drive: those of the thesis (chapter 5) and of the studies beyond it."""

import jackal_aic
import numpy
import scipy.signal

import motions

FINAL = 0.5  # s at the end over which a final value is the mean
RUNAWAY = 10.0  # multiples of the largest set point at which a belief counts as diverged
INSIDE_95 = 5.991  # chi-squared with two degrees of freedom


def has_belief(drive):
    return drive.controller_name != 'diff_drive'


def set_point_changes(drive):
    """Indices at which the set point changes."""
    return numpy.flatnonzero((numpy.diff(drive.set_speed, prepend=0.0) != 0.0) | (numpy.diff(drive.set_yaw_rate, prepend=0.0) != 0.0))


def belief_ran_away(drive, channel):
    """A belief that is not finite or far beyond every set point, which the limits of the command can hide from the velocity."""
    if not has_belief(drive):
        return False
    believed = getattr(drive, 'believed_' + channel)
    largest = numpy.max(numpy.abs(getattr(drive, 'set_' + channel)))
    return bool(numpy.any(~(numpy.abs(believed) <= RUNAWAY * largest)))


def response(drive, motion, band=0.05):
    """Settling, rise, overshoot and steady-state error of the assessed step; an unbounded response has none. Without a step only `bounded` is returned."""
    figures = {'settling_s': None, 'rise_s': None, 'overshoot_pct': None, 'steady_error_pct': None, 'bounded': True}
    if motion.channel is None:
        figures['bounded'] = not (belief_ran_away(drive, 'speed') or belief_ran_away(drive, 'yaw_rate'))
        return figures
    before, after = motion.step()[0 if motion.channel == 'speed' else 1]
    until = numpy.searchsorted(drive.time, motion.end + 1e-9, side='right')
    found = jackal_aic.step_response(drive.time[:until], getattr(drive, motion.channel)[:until], motion.start, before, after, band)
    figures['bounded'] = found.bounded and not belief_ran_away(drive, motion.channel)
    if figures['bounded']:
        figures.update(settling_s=found.settling_time, rise_s=found.rise_time, overshoot_pct=found.overshoot,
                       steady_error_pct=found.steady_error)
    return figures


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values))))


def errors(drive, motion):
    """Root mean squares since the first step of tracking (true minus set) and belief (believed minus true), and the
    belief's mean error at the end of the assessed step [% of the set point]."""
    late = drive.time >= motions.REST
    figures = {'tracking_rms_mps': rms((drive.speed - drive.set_speed)[late]),
               'tracking_rms_radps': rms((drive.yaw_rate - drive.set_yaw_rate)[late])}
    if not has_belief(drive):
        return figures
    figures['belief_rms_mps'] = rms((drive.believed_speed - drive.speed)[late])
    figures['belief_rms_radps'] = rms((drive.believed_yaw_rate - drive.yaw_rate)[late])
    if motion.channel is not None:
        last = (drive.time >= motion.end - FINAL) & (drive.time <= motion.end)
        error = getattr(drive, 'believed_' + motion.channel) - getattr(drive, motion.channel)
        figures['belief_bias_pct'] = float(100.0 * numpy.sum(error[last]) / numpy.sum(getattr(drive, 'set_' + motion.channel)[last]))
    return figures


def swings(values, threshold):
    """Turning points that stand out from both their neighbours by more than a threshold."""
    return sum(len(scipy.signal.find_peaks(sign * numpy.asarray(values), prominence=threshold)[0]) for sign in (1.0, -1.0))


def normalised_error(error_speed, error_yaw_rate, speed_variance, covariance, yaw_rate_variance):
    """Squared Mahalanobis distance of an error of the motion under its covariance."""
    determinant = speed_variance * yaw_rate_variance - covariance**2
    return (yaw_rate_variance * error_speed**2 - 2.0 * covariance * error_speed * error_yaw_rate +
            speed_variance * error_yaw_rate**2) / determinant
