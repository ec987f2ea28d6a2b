"""Identification of a drive train from a recorded drive.

Commands and wheel speeds give dead time, lag, gain, offset and acceleration limit. Wheel speeds and yaw rate give the effective track of
each turn direction. Model of each wheel, with command u, speed w and wheel radius r:

    dw/dt = clip((target - w) / lag, -limit / r, limit / r),
    target = sign(u) max(0, gain |u| - offset),  u = u(t - dead_time)

It is fitted to all wheel speeds at once by least squares. Motors with an offset turn slower than commanded by a fixed amount, and stand
below it (clearpath_robot#280). Recordings are cut at gaps, and where the commands do not explain the driving. The 95 % confidence
intervals are those of the linearised fit, with residuals that are correlated over a second. They cover both drive trains if left and
right, or forward and backward, differ, and fresh and old wheel speeds if a driver repeats them.
"""

import copy
import functools
import math
import typing

import numpy
import scipy.optimize
import scipy.signal
import scipy.stats

# Parameters of the fit: dead time [s], lag [s], gain, ln of the acceleration limit [m/s^2], offset [rad/s]; their range; and the steps by
# which derivatives are taken, wide enough to bridge the kinks where a command switches between two samples.
DEAD_TIME, LAG, GAIN, LOG_LIMIT, OFFSET = ALL = range(5)
LOWEST = numpy.array([-0.1, 0.0, 0.1, math.log(0.1), -3.0])
HIGHEST = numpy.array([0.5, 1.0, 3.0, math.log(100.0), 3.0])
STEPS = numpy.array([0.002, 0.002, 0.005, 0.05, 0.02])
NAMES, UNITS = ('dead time', 'lag', 'gain', 'acceleration limit', 'offset'), (' s', ' s', '', ' m/s^2', ' rad/s')

BLOCK = 1.0  # s over which residuals are taken to depend on each other
LEAST_COMMAND = 0.5  # rad/s, commands below this excite nothing
LEAST_SAMPLES = 100  # measurements of the wheels, 2 s at 50 Hz
LEAST_TURN, LEAST_TURN_SAMPLES = 0.5, 25  # rad/s between the sides, to count as a turn; samples of it
SMALLEST_TRACK, LARGEST_TRACK = 2.0, 20.0  # wheel radii, for a slip factor of 1; skid-steer robots have about 6
GAP, LEAST_STRETCH = 0.5, 1.5  # s without wheel speeds or commands, at which a recording is cut; shortest part between two gaps
UNKNOWN_START = 0.6  # s at the start of a part, in which commands act that were sent before it
OPPOSED, EXCHANGED = -0.5, 0.3  # correlation of wheel and command of an inverted side; by which the other side's command explains more
LEAST_R_SQUARED = 0.9  # share of the variance of the wheel speeds that the model has to explain
BETTER = 0.9  # sum of squares with / without clipping or acceleration limit, below which there is one
LIKELY, SURE = 1.5, 2.33  # standard deviations by which a limit has to explain more than none does, to be fitted and to be reported
UNEXPLAINED, UNUSUAL = 0.5, 5.0  # residual / deviation of the speeds, and / median residual, above which a second is cut
LARGEST_CUT = 0.5  # share of the values that may be cut
RELEVANT = (0.01, 0.02, 0.03)  # differences of dead time [s], lag [s] and gain that are worth a remark


class Estimate(typing.NamedTuple):
    """An estimated quantity, half the width of its 95 % confidence interval, and why it is unknown (empty if it is known)."""

    value: float = 0.0
    half_width: float = 0.0
    unknown: str = ''

    @property
    def known(self) -> bool:
        """It was estimated."""
        return not self.unknown

    @property
    def significant(self) -> bool:
        """It is known to be above zero: its interval does not reach down to it."""
        return self.known and self.value > self.half_width

    def covering(self, value, half_width):
        """The same with an interval over another one, too."""
        return self._replace(half_width=max(self.half_width, abs(value - self.value) + half_width))

    def __repr__(self):
        return '{:.4g} +- {:.2g}'.format(self.value, self.half_width) if self.known else 'unknown: ' + self.unknown


class Identification(typing.NamedTuple):
    """Drive train that a recording shows."""

    dead_time: Estimate  # [s]
    lag: Estimate  # [s]
    gain: Estimate  # wheel speed per command, above the offset
    offset: Estimate  # by which wheels turn slower than gain x command [rad/s]
    acceleration_limit: Estimate  # of the wheel circumference [m/s^2]; where unknown, value is the largest one seen
    track_left: Estimate  # effective track turning left [m]
    track_right: Estimate  # effective track turning right [m]
    remarks: typing.List[str]  # for the user, one line each
    residual: float  # root mean square of measured minus fitted wheel speed [rad/s]
    r_squared: float  # share of the variance of the wheel speeds that the model explains
    sensor_rate: float  # of wheel speeds, or of the yaw rate where that is lower, rounded [Hz]
    fitted: numpy.ndarray  # wheel speeds of the model at the stamps of the measured ones [rad/s], shape (n, 2)


def identify(commands, wheels, yaw_rate=None, wheel_radius=0.098, slip_factor=1.0) -> Identification:
    """Identifies the drive train from a drive.

    commands: rows (time, left, right) [s, rad/s, rad/s], shape (n, 3), each when it was sent.
    wheels: measured wheel speeds in the same form. yaw_rate: rows (time, yaw rate) [s, rad/s], shape (n, 2), or None.
    wheel_radius: r [m]. slip_factor: alpha; only alpha / b_hat can be measured (3-1), so the effective track belongs to it.
    Raises ValueError if the drive contains too little (naming what is missing), has stamps that do not increase, or does not fit the
    model: wheels that never turn, are inverted or exchanged, or answer before their commands; driving that the commands do not explain;
    an estimate at the end of the range searched.
    """
    command_time, commands = _series('wheel commands', commands, 3, 2, 1e4)
    time, wheels = _series('wheel speeds', wheels, 3, LEAST_SAMPLES, 1e4)
    yaw_time, yaw = _series('yaw rate', numpy.empty((0, 2)) if yaw_rate is None else yaw_rate, 2, 0, 1e3)
    remarks = []
    wheels = _without_spikes('wheel speeds', wheels, 0.5, remarks)
    yaw = _without_spikes('yaw rates', yaw, 0.2, remarks)[:, 0]
    if _apart(time, command_time):
        raise ValueError('wheel speeds and commands ' + _apart(time, command_time))
    _check_excitation(commands)
    fit = _Fit(time, wheels, _stretches(time, command_time, commands, remarks), wheel_radius)
    period, renewal = _sampling(time, wheels, remarks)
    is_held = renewal > period
    gain = _check_wheels(fit)
    theta, free, is_limited = _fit_explained(fit, gain, _clipped_speed(time, wheels, command_time, commands), remarks)
    _remark_on_commands(fit, commands, remarks)

    # Values of uncertain age make dead time and lag uncertain [s].
    doubt = 0.5 * (renewal + period) if is_held else 0.0
    half_width, parts, no_offset = _half_widths(fit, theta, free), _parts(fit, theta, free, doubt), ''
    if half_width[OFFSET] > LEAST_COMMAND:
        no_offset = 'the commands are of one speed only; the gain holds at this speed'
    elif any(_differ(*parts[1])):
        no_offset = 'forward and backward differ; the gain is fitted without an offset'
    if no_offset:
        theta, free, is_limited = _search(fit, gain, ALL[:OFFSET])
        half_width, parts = _half_widths(fit, theta, free), _parts(fit, theta, free, doubt)
    r_squared = 1.0 - fit.cost(theta) / fit.total_squares()
    if not r_squared >= LEAST_R_SQUARED:
        raise ValueError('the model leaves {:.0f} % of the variance of the wheel speeds (R^2 = {:.3f}, at least {:g} is needed): the '
                         'wheels do not follow these commands'.format(100.0 * (1.0 - r_squared), r_squared, LEAST_R_SQUARED))
    _check_range(theta, half_width)

    resolution = numpy.array([max(0.02, renewal), max(0.02, renewal), 0.02])  # s, s and 1
    found = [_estimate(*values) for values in zip(numpy.append(max(0.0, theta[DEAD_TIME]), theta[LAG:LOG_LIMIT]), half_width, resolution)]
    offset = Estimate(theta[OFFSET], 0.0 if no_offset else half_width[OFFSET], no_offset)
    if is_held:
        fresh = _part(fit, _is_fresh(time, wheels, renewal - 0.5 * period), theta, free, period)
        found = [estimate.covering(*values) for estimate, *values in zip(found, *fresh)]
        offset = offset if no_offset else offset.covering(fresh[0][OFFSET], fresh[1][OFFSET])
    for names, part in zip(('left and right', 'forward and backward'), parts):
        _cover_both(found, names, part, remarks)
    if offset.significant and offset.value > 0.05:
        remarks.append('offset: the wheels turn {:.2f} rad/s slower than gain times command, and stand below a command of {:.2f} '
                       'rad/s'.format(offset.value, offset.value / theta[GAIN]))
    limit = _acceleration_limit(fit, theta, half_width[LOG_LIMIT] if is_limited else math.inf)
    bias = _gyro_bias(time, wheels, yaw_time, yaw)
    tracks = [_effective_track(time, wheels, yaw_time, yaw, bias, wheel_radius * slip_factor, sign) for sign in (1.0, -1.0)]
    return Identification(*found, offset, limit, *tracks, remarks, math.sqrt(fit.cost(theta) / fit.counts.sum()), r_squared,
                          _sensor_rate(max(period, _usual(numpy.diff(yaw_time)))), fit.simulate(theta))


# ---- the recording

def _series(name, rows, columns, least, largest):
    """Stamps and values of a series. Raises ValueError if it is not usable."""
    rows = numpy.asarray(rows, float)
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise ValueError('{}: must have the shape (n, {})'.format(name, columns))
    if len(rows) < least:
        raise ValueError('{}: {} samples, at least {} are needed'.format(name, len(rows), least))
    time, values = rows[:, 0], rows[:, 1:]
    if not numpy.isfinite(time).all():
        raise ValueError('{}: a stamp is not finite'.format(name))
    for i in numpy.flatnonzero(numpy.diff(time) < 0.0)[:1]:
        raise ValueError('{}: stamps are not monotonic ({:.3f} s is followed by {:.3f} s)'.format(name, time[i], time[i + 1]))
    for i, side in numpy.argwhere(~(abs(values) <= largest))[:1]:
        if not math.isfinite(values[i, side]):
            raise ValueError('{} at {:.3f} s: a value is not finite'.format(name, time[i]))
        raise ValueError('{} = {:g} rad/s at {:.3f} s: must be within +-{:g} rad/s'.format(name, values[i, side], time[i], largest))
    return time, values


def _without_spikes(name, values, least, remarks):
    """Replaces values that jump away from the others by more than `least`, and back, by the median of the five around them."""
    unlikely, rare = 12.0, 20  # median distances from the local median; samples for each spike, more frequent jumps are no spikes
    values, spikes = values.copy(), 0
    for column in values.T if len(values) > 4 else ():
        median = scipy.signal.medfilt(column, 5)
        distance = abs(column - median)[2:-2]
        found = 2 + numpy.flatnonzero(distance > max(least, unlikely * numpy.median(distance)))
        if rare * len(found) <= len(column):
            column[found] = median[found]
            spikes += len(found)
    if spikes:
        remarks.append('spikes: {} of {} {} left out'.format(spikes, values.size, name))
    return values


def _apart(one, other):
    """The times of two series that do not overlap; empty if they do."""
    if not len(one) or not len(other) or (one[0] <= other[-1] and other[0] <= one[-1]):
        return ''
    return 'do not overlap in time ({:.3f} to {:.3f} s, {:.3f} to {:.3f} s)'.format(one[0], one[-1], other[0], other[-1])


def _check_excitation(commands):
    """Both sides share one drive train, so both have to be excited."""
    least, steps = 2, [0, 0]
    for side, column in enumerate(commands.T):
        previous = 0.0
        for command in column:
            if abs(command - previous) >= LEAST_COMMAND:
                steps[side] += 1
                previous = command
    if min(steps) < least:
        side = ' of the right wheels' if steps[0] >= least else ' of the left wheels' if steps[1] >= least else ''
        raise ValueError('wheel commands: no excitation{} ({} steps of {:g} rad/s or more, at least {} are needed)'.format(
            side, min(steps), LEAST_COMMAND, least))


class _Stretch(typing.NamedTuple):
    """A part of a recording without a gap: its samples, and the changes of the commands, the first in force at the beginning."""
    samples: slice
    command_time: numpy.ndarray  # s
    commands: numpy.ndarray  # rad/s, shape (k, 2)


def _stretches(time, command_time, commands, remarks):
    """The parts of a recording between its gaps; parts that are too short are left out, with a remark."""
    latest = numpy.searchsorted(command_time, time, side='right') - 1
    is_known = (latest >= 0) & (time - command_time[latest] <= GAP)
    is_joined = is_known[1:] & is_known[:-1] & (numpy.diff(time) <= GAP)  # with the sample before
    begins = numpy.flatnonzero(is_known & ~numpy.append(False, is_joined))
    ends = 1 + numpy.flatnonzero(is_known & ~numpy.append(is_joined, False))
    stretches, used = [], 0.0
    for begin, end in zip(begins, ends):
        length = time[end - 1] - time[begin]
        if length >= LEAST_STRETCH:
            used += length
            sent = slice(latest[begin], latest[end - 1] + 1)
            changes = numpy.append(True, (numpy.diff(commands[sent], axis=0) != 0.0).any(axis=1))
            stretches.append(_Stretch(slice(begin, end), command_time[sent][changes], commands[sent][changes]))
    gaps = len(begins) - int(is_known[-1])
    if gaps > 0:
        remarks.append('cut: {} gap{} of more than {:g} s in the wheel speeds or the commands; {:.1f} s used'.format(
            gaps, '' if gaps == 1 else 's', GAP, used))
    if not stretches:
        raise ValueError('wheel speeds and commands: no {:g} s together without a gap of {:g} s or more'.format(LEAST_STRETCH, GAP))
    return stretches


def _usual(intervals):
    """Mean of the intervals above zero that are about as long as the median one [s]; 0 without any."""
    intervals = intervals[intervals > 0.0]
    if not len(intervals):
        return 0.0
    return intervals[abs(intervals / numpy.median(intervals) - 1.0) <= 0.5].mean()


def _sampling(time, wheels, remarks):
    """Time between two samples, and between two measurements: a driver that reads its motors less often than it publishes repeats them.

    Encoders in coarse steps repeat slow changes, too. Only between two changes of more than some steps, as while a wheel comes to speed,
    is a repeated value a held one.
    """
    steps, least = 4.0, 10  # of the encoder; intervals that tell
    period, change = _usual(numpy.diff(time)), abs(numpy.diff(wheels, axis=0))
    has_changed = change.any(axis=1)
    is_large = change.max(axis=1)[has_changed] > steps * numpy.min(change[change > 0.0], initial=math.inf)
    intervals = numpy.diff(time[1:][has_changed])[is_large[1:] & is_large[:-1]]
    renewal = _usual(intervals)
    if len(intervals) < least or renewal <= 1.5 * period:
        return period, period
    held = 'the wheel speeds are renewed every {:.3f} s only, in samples every {:.3f} s'.format(renewal, period)
    measurements = round(len(time) * period / renewal)
    if measurements < LEAST_SAMPLES:
        raise ValueError('{}: {} measurements, at least {} are needed'.format(held, measurements, LEAST_SAMPLES))
    remarks.append('held: {}: the dead time is for values of mean age, its interval covers fresh values'.format(held))
    return period, renewal


def _is_fresh(time, wheels, due):
    """Which samples are the first of a held value, shape (n, 1). A measurement may be equal to the one before: after `due` it counts."""
    is_new, fresh, renewed = numpy.diff(wheels, axis=0).any(axis=1), [False], time[0]
    for i, now in enumerate(time[1:]):
        fresh.append(is_new[i] or now - renewed > due)
        renewed = now if fresh[-1] else renewed
    return numpy.array(fresh)[:, None]


def _sensor_rate(period):
    """Sample rate for a controller, rounded so that a certificate finds a common period with the action [Hz]."""
    rate = min(max(1.0 / max(period, 1e-6), 1.0), 1000.0)
    rounded = [step * round(rate / step) for step in (50.0, 25.0, 10.0, 5.0, 2.0, 1.0)]
    return next((value for value in rounded if abs(value - rate) <= 0.025 * rate), round(rate, 1))


def _clipped_speed(time, wheels, command_time, commands):
    """Wheel speed at which the motors may be clipped [rad/s]: that of the fastest command that was held, if it falls short of the gain of
    the slowest one; else infinite. A fit has to confirm it."""
    held, mean, short, plateaus = 0.8, 0.2, 0.93, []  # s; s at its end; share of the gain; commands and mean speeds
    for speeds, column in zip(wheels.T, commands.T):
        first = numpy.append(0, 1 + numpy.flatnonzero(numpy.diff(column)))
        for begin, stop, command in zip(command_time[first], numpy.append(command_time[first[1:]], time[-1]), column[first]):
            if abs(command) >= LEAST_COMMAND and stop - begin >= held:
                last = speeds[(time > stop - mean) & (time <= stop)]
                plateaus += [(command, last.mean())] if len(last) else []
    plateaus.sort(key=lambda plateau: abs(plateau[0]))
    slow, fast = plateaus[:1], plateaus[-1:]
    return abs(fast[0][1]) if slow and fast[0][1] / fast[0][0] < short * slow[0][1] / slow[0][0] else math.inf


def _remark_on_commands(fit, commands, remarks):
    """On one-sided driving, and on clipped motors."""
    if commands.min() > -LEAST_COMMAND:
        remarks.append('one-sided: the wheels were only driven forward')
    if commands.max() < LEAST_COMMAND:
        remarks.append('one-sided: the wheels were only driven backward')
    if math.isfinite(fit.speed_limit):
        remarks.append('clipped: the wheels did not get beyond {:g} rad/s although up to {:g} rad/s were commanded; the gain holds below '
                       'the clipping'.format(fit.speed_limit, abs(commands).max()))


# ---- the fit

class _Fit:
    """The data of a fit. counts: which values it counts, shape (n, 2); speed_limit: at which the motors are clipped [rad/s]."""

    def __init__(self, time, wheels, stretches, radius):
        self.time, self.wheels, self.stretches, self.radius = time, wheels, stretches, radius
        self.speed_limit, self.blocks = math.inf, _blocks(time)
        self.counts = numpy.zeros(wheels.shape, bool)
        for samples, _, _ in stretches:
            self.counts[samples] = (time[samples] >= time[samples][0] + UNKNOWN_START)[:, None]

    def counting(self, which):
        """The same fit of some of its values."""
        part = copy.copy(self)
        part.counts = self.counts & which
        return part

    def simulate(self, theta):
        """Speeds of the model [rad/s] at the stamps, shape (n, 2), measured ones outside all stretches; (n, 2, p) for p parameter vectors
        as columns."""
        vectors = theta.reshape(len(ALL), -1)
        speeds = numpy.repeat(self.wheels[:, :, None], vectors.shape[1], axis=2)
        for stretch in self.stretches:
            speeds[stretch.samples] = self._simulate(stretch, *vectors)
        return speeds.reshape(self.wheels.shape + theta.shape[1:])

    def _simulate(self, stretch, dead_time, lag, gain, log_limit, offset):
        """The target is constant between two commands, so that the speed at its beginning gives that of each sample (axes: time, side, p).
        """
        small = 0.3  # rad/s, below which the offset decreases to zero with the command
        time, commands = self.time[stretch.samples], stretch.commands[:, :, None]
        slower = offset * numpy.minimum(1.0, abs(commands) / small)
        targets = numpy.sign(commands) * numpy.clip(gain * abs(commands) - slower, 0.0, self.speed_limit)
        # Earlier commands are unknown, so the speed is kept until the first one acts.
        first = numpy.broadcast_to(self.wheels[stretch.samples][0][:, None], targets[:1].shape)
        targets = numpy.concatenate((first, targets))
        starts = numpy.maximum(time[0], numpy.insert(stretch.command_time, 0, -math.inf)[:, None] + dead_time)
        motor = numpy.maximum(lag, 1e-9), numpy.exp(log_limit) / self.radius
        speeds = targets.copy()
        for k, duration in enumerate(numpy.diff(starts, axis=0)):
            speeds[k + 1] = _speed_after(speeds[k], targets[k], *motor, duration)
        newest = numpy.searchsorted(stretch.command_time, (time[:, None] - dead_time).ravel(), side='right').reshape(len(time), 1, -1)
        duration = numpy.maximum(0.0, time[:, None, None] - numpy.take_along_axis(starts[:, None], newest, axis=0))
        return _speed_after(numpy.take_along_axis(speeds, newest, axis=0), numpy.take_along_axis(targets, newest, axis=0), *motor, duration)

    def residuals(self, theta):
        """Measured minus fitted speed [rad/s], shaped as by simulate(); zero where the wheel does not count."""
        new = (...,) + (None,) * (theta.ndim - 1)
        return self.counts[new] * (self.wheels[new] - self.simulate(theta))

    def cost(self, theta):
        """Sum of the squared residuals, of each parameter vector."""
        return (self.residuals(theta) ** 2).sum(axis=(0, 1))

    def linearised(self, theta, free):
        """Residuals, and their derivatives by the free parameters, shape (n, 2, len(free)).

        The derivative by a lag near zero vanishes, although the recording excludes longer ones: that by 5 ms stands for it.
        """
        free, at = list(free), numpy.maximum(theta, (-math.inf, 0.005, -math.inf, -math.inf, -math.inf))
        up, down = numpy.minimum(at + STEPS, HIGHEST), numpy.maximum(at - STEPS, LOWEST)
        vectors = numpy.repeat(theta[:, None], 1 + 2 * len(free), axis=1)
        for column, i in enumerate(free, 1):
            vectors[i, [column, column + len(free)]] = up[i], down[i]
        residuals, of_up, of_down = numpy.split(self.residuals(vectors), (1, 1 + len(free)), axis=2)
        return residuals[:, :, 0], (of_up - of_down) / (up - down)[free]

    def total_squares(self):
        """Sum of the squared deviations of the wheel speeds that count from the mean of their side."""
        return sum(counts.sum() * numpy.var(speeds[counts]) for speeds, counts in zip(self.wheels.T, self.counts.T))

    def by_block(self, values):
        """Sums of values of the samples over each block of time."""
        return numpy.add.reduceat(values, self.blocks, axis=0)


def _blocks(time):
    """The first sample of each block of time."""
    blocks = [0]
    while time[-1] >= time[blocks[-1]] + BLOCK:
        blocks.append(numpy.searchsorted(time, time[blocks[-1]] + BLOCK))
    return blocks


def _speed_after(speed, target, lag, limit, duration):
    """Speed after a time under a constant target: first at the acceleration limit, then exponentially."""
    error = target - speed
    limited = numpy.minimum(numpy.maximum(abs(error) / limit - lag, 0.0), duration)  # s at the limit
    return target - numpy.copysign((abs(error) - limit * limited) * numpy.exp((limited - duration) / lag), error)


def _refine(fit, theta, free):
    """Least squares near a parameter vector over the free parameters."""
    free = list(free)

    def vector(values):
        result = theta.copy()
        result[free] = values
        return result

    @functools.lru_cache(maxsize=2)
    def linearised(*values):
        residuals, derivatives = fit.linearised(vector(values), free)
        return residuals.ravel(), derivatives.reshape(-1, len(free))
    return vector(scipy.optimize.least_squares(
        lambda values: linearised(*values)[0], theta[free], lambda values: linearised(*values)[1], bounds=(LOWEST[free], HIGHEST[free]),
        x_scale=STEPS[free], method='dogbox', ftol=1e-8, xtol=3e-6, max_nfev=40).x)


def _search(fit, gain, free):
    """Least squares over the whole range from the best of a coarse grid. Returns the parameters, those that were free, and whether the
    wheels surely reached their acceleration limit. A limit can fit some noise, so it has to explain more than chance (Vuong 1989)."""
    grid = numpy.array([(dead_time, lag, gain, math.log(limit), 0.0) for dead_time in 0.04 * numpy.arange(-1, 13)
                        for lag in (0.01, 0.04, 0.15, 0.4) for limit in (1.0, 3.0, 10.0, 50.0)]).T
    batches = numpy.array_split(grid, 1 + grid.shape[1] * len(fit.time) // 10 ** 6, axis=1)  # for the memory
    costs = numpy.concatenate([fit.cost(batch) for batch in batches])
    limited = min((_refine(fit, grid[:, i], free) for i in numpy.argsort(costs)[:3]), key=fit.cost)
    others = [i for i in free if i != LOG_LIMIT]
    unlimited = _refine(fit, numpy.where(numpy.arange(len(ALL)) == LOG_LIMIT, HIGHEST, limited), others)
    gained = fit.by_block((fit.residuals(unlimited) ** 2 - fit.residuals(limited) ** 2).sum(axis=1))
    advantage = gained.sum() / max(math.sqrt((gained ** 2).sum()), 1e-300)
    # Few blocks with fast changes may decide, which have a large part in the sum.
    if advantage > LIKELY or fit.cost(limited) < BETTER * fit.cost(unlimited):
        return limited, free, advantage > SURE
    return unlimited, others, False


def _half_widths(fit, theta, free):
    """Of the 95 % intervals, for correlated residuals; infinite where the recording does not depend on a parameter.

    The covariance of the linearised fit has scores summed over blocks of time (cluster-robust "sandwich", Liang and Zeger 1986). The
    dead time follows from the few blocks with a step, so Student's distribution has the number of blocks with information about a
    parameter (Carter, Schnepel and Steigerwald 2017).
    """
    half_widths, size = numpy.full(len(ALL), math.inf), fit.counts.sum()
    residuals, derivatives = fit.linearised(theta, free)
    is_seen = (derivatives ** 2).sum(axis=(0, 1)) > 1e-7 * size
    derivatives = derivatives[:, :, is_seen]
    information = numpy.tensordot(derivatives, derivatives, axes=((0, 1), (0, 1)))
    if not is_seen.any() or numpy.linalg.matrix_rank(information) < len(information):
        return half_widths
    bread = numpy.linalg.inv(information)
    scores = fit.by_block((derivatives * residuals[:, :, None]).sum(axis=1))
    shares = fit.by_block(((derivatives @ bread) ** 2).sum(axis=1))
    blocks = numpy.maximum(2.0, shares.sum(axis=0) ** 2 / (shares ** 2).sum(axis=0))
    robust = numpy.diag(bread @ scores.T @ scores @ bread) * blocks / (blocks - 1.0)
    # Blocks of few scores may look quieter than white noise of the same size: the larger variance counts.
    white = numpy.diag(bread) * (residuals ** 2).sum() / max(1, size - len(bread))
    half_widths[numpy.array(free)[is_seen]] = scipy.stats.t.ppf(0.975, blocks - 1.0) * numpy.sqrt(numpy.maximum(robust, white))
    return half_widths


def _check_wheels(fit):
    """Refuses wheels that never turn, turn the other way, or follow the other side's command. Returns the initial gain of the search."""
    least_motion = 0.05  # wheel speed / command (RMS)
    best = numpy.zeros((3, 2, 2))  # correlation, gain and motion of wheel i under command j, by the delay at which they are most alike
    for delay in numpy.arange(0.0, 0.5, 0.04):
        moments = numpy.full((4, 4), 1e-12)  # of wheels and commands
        for samples, command_time, commands in fit.stretches:
            newest = numpy.searchsorted(command_time, fit.time[samples] - delay, side='right') - 1
            values = numpy.hstack((fit.wheels[samples], commands[newest]))[fit.counts[samples][:, 0] & (newest >= 0)]
            moments += values.T @ values
        both, wheels, commands = moments[:2, 2:], numpy.diag(moments)[:2, None], numpy.diag(moments)[2:]
        now = numpy.array([both / numpy.sqrt(wheels * commands), both / commands, numpy.sqrt(wheels / commands)])
        best = numpy.where(abs(now[0]) > abs(best[0]), now, best)
    (correlation, gain, motion), other = (numpy.diagonal(values) for values in best), numpy.diagonal(best[0, :, ::-1])

    def named(which):
        return 'the wheels' if which.all() else 'the left wheels' if which[0] else 'the right wheels'
    is_still, is_opposed = motion < least_motion, correlation < OPPOSED
    if is_still.any():
        raise ValueError(named(is_still) + ' never turn although they are commanded (motors off, emergency stop, or another topic?)')
    if (other > abs(correlation) + EXCHANGED).all():
        raise ValueError("left and right are exchanged: each side's wheels follow the other side's command (correlation {:.2f}, with "
                         'their own {:.2f})'.format(other.min(), correlation.max()))
    if is_opposed.any():
        raise ValueError('{} turn against their commands (correlation {:.2f}): wheels or commands are inverted'.format(
            named(is_opposed), correlation.min()))
    return min(max(gain.mean(), 0.2), 2.5)


def _cut_unexplained(fit, theta):
    """Cuts the seconds that the commands do not explain, and their neighbours: another source drives, or the robot is pushed or held.
    Returns their time [s]."""
    values = fit.by_block(fit.counts.sum(axis=1))
    known = numpy.flatnonzero(values)
    rms = numpy.sqrt(fit.by_block((fit.residuals(theta) ** 2).sum(axis=1))[known] / values[known])
    is_wrong = rms > max(UNEXPLAINED * math.sqrt(fit.total_squares() / values.sum()), UNUSUAL * numpy.median(rms))
    cut, ends = 0.0, fit.blocks[1:] + [len(fit.time)]
    for block in known[numpy.convolve(is_wrong, (1, 1, 1), 'same') > 0]:
        counted = fit.blocks[block] + numpy.flatnonzero(fit.counts[fit.blocks[block]:ends[block]].any(axis=1))
        cut += fit.time[counted[-1]] - fit.time[counted[0]]
        fit.counts[counted] = False
    return cut


def _fit_explained(fit, gain, clipped, remarks):
    """_search() of the driving that the commands explain, with motors that are clipped at a speed if that explains more."""
    found, size, cut = _search(fit, gain, ALL), fit.counts.sum(), 0.0
    if math.isfinite(clipped):
        free, fit.speed_limit = fit.cost(found[0]), clipped
        of_clipped = _search(fit, gain, ALL)
        if fit.cost(of_clipped[0]) < BETTER * free:
            found = of_clipped
        else:
            fit.speed_limit = math.inf
    for _ in range(3):
        more = _cut_unexplained(fit, found[0])
        if more <= 0.0:
            break
        cut += more
        left_out = 1.0 - fit.counts.sum() / size
        if left_out > LARGEST_CUT:
            raise ValueError('the commands do not explain the driving in {:.0f} % of the recording (at most {:.0f} % may be cut)'.format(
                100.0 * left_out, 100.0 * LARGEST_CUT))
        found = _search(fit, gain, ALL)
    if cut > 0.0:
        remarks.append('cut: {:.1f} s of driving that the commands do not explain'.format(cut))
    return found


def _check_range(theta, half_width):
    """Refuses estimates at the end of the range searched, and wheels that answer before their commands."""
    near = 1e-4 * (HIGHEST - LOWEST)
    is_lowest, is_highest = theta - LOWEST < near, HIGHEST - theta < near
    if theta[DEAD_TIME] + half_width[DEAD_TIME] < 0.0 or is_lowest[DEAD_TIME]:
        raise ValueError('the wheels answer before their commands (dead time {:.4f} +- {:.4f} s): stamps of the wheel speeds and times of '
                         'the commands are not of one clock'.format(theta[DEAD_TIME], half_width[DEAD_TIME]))
    is_lowest[LAG] = is_highest[LOG_LIMIT] = False  # wheels that follow at once, or never reach a limit
    for i in numpy.flatnonzero(is_lowest | is_highest)[:1]:
        bound = (LOWEST if is_lowest[i] else HIGHEST)[i]
        raise ValueError('{}: the estimate is at the end of the range searched, {:.4g}{}: the recording does not fit the model'.format(
            NAMES[i], math.exp(bound) if i == LOG_LIMIT else bound, UNITS[i]))


# ---- parts of a drive, compared with each other

def _part(fit, which, theta, free, doubt):
    """Parameters near those of the whole and half widths, from some of the values, with a doubt about their age [s]."""
    fit = fit.counting(which)
    near = _refine(fit, theta, free)
    return near, _half_widths(fit, near, free) + numpy.where(numpy.arange(len(ALL)) <= LAG, doubt, 0.0)


def _parts(fit, theta, free, doubt):
    """Left and right, and wheels that turn forward and backward in the common fit, each with the common offset."""
    speeds, sides, free = fit.simulate(theta), numpy.arange(2), [i for i in free if i != OFFSET]
    return [[_part(fit, which, theta, free, doubt) for which in both] for both in ((sides == 0, sides == 1), (speeds > 0.0, speeds < 0.0))]


def _differ(one, other):
    """In which of dead time, lag and gain two parts differ, by more than their intervals and by a relevant amount."""
    return abs(one[0] - other[0])[:3] > numpy.maximum(RELEVANT, (one[1] + other[1])[:3])


def _cover_both(estimates, names, parts, remarks):
    """Widens the intervals of dead time, lag and gain over both parts where they differ, and says so."""
    differences = []
    for i in numpy.flatnonzero(_differ(*parts)):
        for theta, half_width in parts:
            estimates[i] = estimates[i].covering(theta[i], half_width[i])
        differences.append('{} {:.3f} and {:.3f}{}'.format(NAMES[i], parts[0][0][i], parts[1][0][i], UNITS[i]))
    if differences:
        remarks.append('{} differ: {}; the intervals cover both'.format(names, ', '.join(differences)))


def _estimate(value, half_width, resolution):
    """Unknown if the recording does not depend on it, or its interval is wider than its value and the resolution."""
    is_known = half_width <= max(abs(value), resolution)
    return Estimate(value, half_width, '' if is_known else 'the recording does not depend on it')


def _acceleration_limit(fit, theta, half_width):
    """The acceleration limit, if the wheels surely reached it; else the largest acceleration of the fit, as a lower bound."""
    limit = math.exp(theta[LOG_LIMIT])
    if half_width <= 1.0:
        return Estimate(limit, limit * half_width)
    speeds, largest = fit.simulate(theta), 0.0
    for samples, _, _ in fit.stretches:
        duration, change = numpy.diff(fit.time[samples]), abs(numpy.diff(speeds[samples], axis=0)).max(axis=1)
        largest = max(largest, (change[duration > 0.0] / duration[duration > 0.0]).max())
    return Estimate(fit.radius * largest, limit * half_width, 'never reached; at least the largest acceleration seen')


# ---- the effective track

def _gyro_bias(time, wheels, yaw_time, yaw):
    """Yaw rate at standing wheels [rad/s] and its variance, by a straight line through the samples with slow wheels, so that slow turns
    do not count as bias."""
    slow, unknown = 0.2, 0.02  # rad/s of the wheels; standard deviation of the bias without any rest
    newest = numpy.maximum(numpy.searchsorted(time, yaw_time + 1e-6, side='right') - 1, 0)
    is_slow = (abs(wheels[newest]) <= slow).all(axis=1)
    if is_slow.sum() < LEAST_TURN_SAMPLES:
        return 0.0, unknown ** 2
    line = numpy.column_stack((numpy.ones(is_slow.sum()), wheels[newest][is_slow] @ (-1.0, 1.0)))
    inverse = numpy.linalg.pinv(line.T @ line)
    values = inverse @ line.T @ yaw[is_slow]
    return values[0], inverse[0, 0] * ((yaw[is_slow] - line @ values) ** 2).sum() / (len(line) - 2)


def _effective_track(time, wheels, yaw_time, yaw, bias, rolling_radius, sign):
    """Effective track of one turn direction by least squares of yaw rate = r alpha (omega_R - omega_L) / b. rolling_radius: r alpha [m]."""
    longest = 0.15  # s between two yaw rates
    apart, name, difference = _apart(time, yaw_time), 'left' if sign > 0.0 else 'right', wheels @ (-1.0, 1.0)
    if not len(yaw):
        return Estimate(unknown='no IMU data')
    if apart:
        return Estimate(unknown='wheel speeds and IMU data ' + apart)
    turns = sign * difference >= LEAST_TURN
    if turns.sum() < LEAST_TURN_SAMPLES:
        return Estimate(unknown='no turn to the {} ({} samples of one, at least {} are needed)'.format(
            name, turns.sum(), LEAST_TURN_SAMPLES))
    around = numpy.concatenate(([math.inf], numpy.diff(yaw_time), [math.inf]))[numpy.searchsorted(yaw_time, time)]  # s, of each sample
    pairs = turns & (around <= longest)
    if pairs.sum() < LEAST_TURN_SAMPLES:
        return Estimate(unknown='no IMU data within {:g} s of turns to the {} but for {} samples, at least {} are needed'.format(
            longest, name, pairs.sum(), LEAST_TURN_SAMPLES))
    x, y = rolling_radius * difference[pairs], numpy.interp(time[pairs], yaw_time, yaw) - bias[0]
    xx, xy, smallest, largest = x @ x, x @ y, SMALLEST_TRACK * rolling_radius, LARGEST_TRACK * rolling_radius
    correlation = xy / math.sqrt(max(xx * (y @ y), 1e-300))
    if correlation < OPPOSED and xy * largest < -xx:
        return Estimate(unknown='the yaw rate is opposed to the wheels (IMU upside down, or left and right exchanged?)')
    if xy * smallest >= xx or (correlation > -OPPOSED and xy * largest <= xx):
        return Estimate(unknown='{:.4g} m, must be within {:.3g} to {:.3g} m ({:g} to {:g} wheel radii): is the gyro in rad/s, mounted as '
                        'said, and the wheel radius right?'.format(xx / xy, smallest, largest, SMALLEST_TRACK, LARGEST_TRACK))
    if xy * largest <= xx:
        return Estimate(unknown='the yaw rate does not follow the wheels (robot on blocks?)')
    slope = xy / xx  # 1/b
    residuals = y - slope * x
    scores = numpy.add.reduceat(x * residuals, _blocks(time[pairs]))
    freedom = max(1, len(scores) - 1)
    variance = max(scores @ scores * len(scores) / freedom / xx, residuals @ residuals / (len(x) - 1)) / xx + bias[1] * (x.sum() / xx) ** 2
    return Estimate(1.0 / slope, scipy.stats.t.ppf(0.975, freedom) * math.sqrt(variance) / slope ** 2)
