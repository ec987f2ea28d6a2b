"""Recordings of real skid-steer robots through the drive loop: false alarms, and the learned turn.

Two kinds of CSV files, told apart by their columns: logs, in which the command is known only while `state` is `calib`, and windows of
2 s, in the order of time within a calib_step. Speeds of wheels are in rad/s; sides are (left, right).
"""

import csv
import math
import pathlib
import types
import typing

import jackal_aic
import numpy

import engine
import metrics
import robots
import search

SENSORS = ['wheel_left_radps', 'wheel_right_radps', 'gyro_z_radps', 'accel_x_mps2', 'accel_y_mps2', 'accel_z_mps2', 'lidar_x_m',
           'lidar_y_m', 'lidar_yaw_rad']
LOG = ['time_s', 'state', 'command_forward_mps', 'command_yaw_radps'] + SENSORS
WINDOWS = ['window', 'calib_step', 'steady', 'time_s', 'cmd_left_radps', 'cmd_right_radps'] + SENSORS
ROBOTS = {'husky': (0.1651, 0.5708), 'warthog': (0.30, 1.1652)}  # wheel radius and distance of the sides [m]
PERIOD = 0.05  # s, of the samples
LONGEST_GAP = 0.175  # s within a stretch
PAUSE = 10.0  # s on the clock between stretches of windows, which have none
STEADY, WINDOW = 2.0, 2.0  # s, after a command of a log until the robot moves steadily; length of a window
BLOCK = 40  # samples of a steady piece
TICK = 0.01  # s between calls of the loop's timer
TRACK_MULTIPLIER, TRACK_RANGE = 1.5, 4.0  # of the distance of the sides; a Husky on a smooth floor turns by less than half of its geometry
STUCK, REVERSED = 'does not move although its wheels turn', 'gyro turns against the wheels: mounted upside down?'


# ---- reading

def _columns(path):
    """Columns of a file by name."""
    with open(path, newline='') as file:
        names, *rows = list(csv.reader(file)) or [[]]
    if names not in (LOG, WINDOWS):
        raise ValueError('columns of no known kind of recording; a log begins with time_s, state, windows with window, calib_step')
    if not rows:
        raise ValueError('has no rows')
    for line, row in enumerate(rows, 2):
        if len(row) != len(names):
            raise ValueError('line {}: has {} values; expected {}'.format(line, len(row), len(names)))
    return {name: numpy.array(values if name == 'state' else [float(value) for value in values]) for name, values in zip(names, zip(*rows))}


def _changes(values):
    """Where values, shape (n,) or (n, k), differ from those before them; the first does."""
    return numpy.append(True, numpy.reshape(values[1:] != values[:-1], (len(values) - 1, -1)).any(axis=1))


def _require(good, time, words):
    """Raises ValueError for the first line that is not good. words: with a place for the time of the row before."""
    if not good.all():
        bad = int(numpy.argmin(good))
        raise ValueError('line {}: time_s = {:g}: must {}'.format(bad + 2, time[bad], words.format(time[bad - 1])))


def _read_log(found, radius, distance):
    time, known = found['time_s'], found['state'] == 'calib'
    gaps = numpy.diff(time, prepend=-math.inf)
    _require(gaps > 0.0, time, 'be above {:g}, that of the row before')
    body = numpy.stack([found['command_forward_mps'], found['command_yaw_radps']], axis=1)
    starts = _changes(known) | (gaps > LONGEST_GAP)
    begins = known & (starts | _changes(body))
    since = time[numpy.maximum.accumulate(numpy.where(begins, numpy.arange(len(time)), 0))]
    half = 0.5 * distance * body[:, 1]
    commands = numpy.stack([body[:, 0] - half, body[:, 0] + half], axis=1) / radius
    commands[~known] = math.nan
    return time, commands, numpy.where(known, numpy.cumsum(begins) - 1, -1), known & (time - since >= STEADY), starts


def _read_windows(found):
    time, window, step = found['time_s'], found['window'], found['calib_step'].astype(int)
    new = _changes(window)
    _require((time >= 0.0) & (time < WINDOW) & (new | (numpy.diff(time, prepend=-1.0) > 0.0)), time,
             'be in [0, {:g}) and increase in a window'.format(WINDOW))
    starts = _changes(step) | (new & (numpy.diff(window, prepend=window[0]) != 1.0))
    begins = numpy.where(new, WINDOW + numpy.where(starts, PAUSE, 0.0), 0.0)
    begins[0] = 0.0
    return (numpy.cumsum(begins) + time, numpy.stack([found['cmd_left_radps'], found['cmd_right_radps']], axis=1), step,
            found['steady'] != 0.0, starts)


def read(path):
    """A recording from a file: its name, wheel_radius and wheel_distance [m], has_imu, and arrays with a value for each sample: time [s];
    wheels [rad/s], shape (n, 2); yaw_rate [rad/s]; acceleration [m/s^2], shape (n, 3); heading [rad]; commands [rad/s], shape (n, 2), NaN
    where they are not known; step of the commands, -1 without one; whether the robot moves steady, and whether a stretch starts.
    Raises ValueError with file and reason."""
    name = pathlib.Path(path).stem
    known = [robot for robot in ROBOTS if name.startswith(robot)]
    if not known:
        raise ValueError("'{}': begins with the name of no known robot; known: {}".format(path, ', '.join(ROBOTS)))
    radius, distance = ROBOTS[known[0]]
    try:
        found = _columns(path)
        time, commands, step, steady, starts = _read_log(found, radius, distance) if 'state' in found else _read_windows(found)
    except (OSError, ValueError, csv.Error) as error:
        raise ValueError("'{}': {}".format(path, error)) from error
    wheels, yaw_rate = numpy.stack([found[key] for key in SENSORS[:2]], axis=1), found['gyro_z_radps']
    acceleration = numpy.stack([found[key] for key in SENSORS[3:6]], axis=1)
    return types.SimpleNamespace(
        name=name, wheel_radius=radius, wheel_distance=distance, has_imu=bool((yaw_rate != 0.0).any() or (acceleration[:, 2] != 0.0).any()),
        time=time, wheels=wheels, yaw_rate=yaw_rate, acceleration=acceleration, heading=found['lidar_yaw_rad'], commands=commands, step=step,
        steady=steady, starts=starts)


def paths(directory):
    """Recordings of a directory by name."""
    found = sorted(str(path) for path in pathlib.Path(directory).glob('*.csv') if path.is_file())
    if not found:
        raise ValueError("data = '{}': holds no file *.csv".format(directory))
    return found


def steady_blocks(recording):
    """Steady pieces of a recording, in order: step; means of commands and wheels [rad/s], shapes (m, 2), and yaw_rate [rad/s], by the
    gyro, or else by lidar."""
    usable = recording.steady & ~numpy.isnan(recording.commands[:, 0])
    ends = numpy.flatnonzero(recording.starts | _changes(recording.step) | _changes(usable))[1:]
    pieces = [piece for piece in numpy.split(numpy.arange(len(usable)), ends) if usable[piece[0]]]
    blocks = [piece[i:i + BLOCK] for piece in pieces for i in range(0, len(piece) - BLOCK + 1, BLOCK)]
    blocks = numpy.array(blocks, int).reshape(-1, BLOCK)
    if recording.has_imu:
        turns = recording.yaw_rate[blocks].mean(axis=1)
    else:
        headings = numpy.unwrap(recording.heading[blocks], axis=1)
        turns = (headings[:, -1] - headings[:, 0]) / PERIOD / (BLOCK - 1)
    return types.SimpleNamespace(step=recording.step[blocks[:, -1]], commands=recording.commands[blocks[:, -1]],
                                 wheels=recording.wheels[blocks].mean(axis=1), yaw_rate=turns)


# ---- what reached the motors

class CommandPath(typing.NamedTuple):
    """Processing of a recorded command by the robot's own software, up to the motors. It scales mean and difference of
    the sides, bounds the difference, slows both sides if one is too fast, and limits their acceleration. A monitor on
    the robot receives the motors' commands, so the replay needs them."""

    forward_gain: float = 1.0
    yaw_gain: float = 1.0
    largest_difference: float = 1e3  # rad/s
    largest_wheel_speed: float = 1e3  # rad/s
    forward_rate: float = 1e6  # rad/s^2
    difference_rate: float = 1e6  # rad/s^2

    def parts(self, commands):
        """Mean and difference of the sides after gains and cut, shape (n, 2)."""
        return numpy.stack([self.forward_gain * _part(commands, 0), numpy.clip(
            self.yaw_gain * _part(commands, 1), -self.largest_difference, self.largest_difference)], axis=-1)

    def slowed(self, parts):
        """Sides of means and differences, shape (n, 2)."""
        sides = numpy.stack([parts[..., 0] - 0.5 * parts[..., 1], parts[..., 0] + 0.5 * parts[..., 1]], axis=-1)
        fastest = numpy.maximum(numpy.abs(sides).max(axis=-1, keepdims=True), 1e-9)
        return sides * numpy.minimum(1.0, self.largest_wheel_speed / fastest)

    def applied(self, commands):
        """Commands of the motors for recorded commands."""
        return self.slowed(self.parts(commands))


def _part(sides, index):
    """Mean (0) or difference (1) of the sides."""
    return sides.mean(axis=-1) if index == 0 else sides[..., 1] - sides[..., 0]


def _ratio(commands, wheels):
    """Median of measured / recorded over pieces with moderate values, neither noise nor bounded."""
    moderate = numpy.sort(numpy.abs(commands))[len(commands) // 2]
    some = (numpy.abs(commands) > 0.2 * moderate) & (numpy.abs(commands) < moderate)
    ratios = numpy.sort(wheels[some] / commands[some])
    return float(numpy.clip(ratios[len(ratios) // 2] if len(ratios) else 1.0, 0.2, 5.0))


def _rate(recording, path, index):
    """The acceleration limit that explains a part of the wheel speeds best, over delays up to 0.4 s [rad/s^2]."""
    rates = 0.5 * 1.15**numpy.arange(38)
    delays = numpy.arange(9)
    measured, wanted = _part(recording.wheels, index), path.parts(recording.commands)[:, index]
    change = (rates * PERIOD)[:, None]
    now, error, begin = numpy.zeros((len(rates), len(delays))), numpy.zeros((len(rates), len(delays))), 0
    for i, starts in enumerate(recording.starts):
        if starts:
            begin = i
            now[:] = measured[i]
        if math.isnan(wanted[i]):
            continue
        delayed = delays[:i - begin + 1]
        some = now[:, :len(delayed)]
        some += numpy.clip(wanted[i - delayed] - some, -change, change)
        error[:, :len(delayed)] += numpy.abs(some - measured[i])
    return float(rates[numpy.unravel_index(numpy.argmin(error), error.shape)[0]])


def fit_path(recording):
    """The command processing that explains a recording best, by the least sum of absolute errors. Unchanged commands
    with fewer than 8 pieces, or if the wheels stand or turn against the commands, which strong bounds would hide."""
    blocks = steady_blocks(recording)
    commands, wheels = blocks.commands, blocks.wheels
    parts = [(_part(commands, i), _part(wheels, i)) for i in (0, 1)]
    if len(commands) < 8 or any(numpy.sum(commanded * done) < 0.05 * numpy.sum(commanded**2) for commanded, done in parts):
        return CommandPath()
    fastest, widest = float(numpy.abs(wheels).max()), float(numpy.abs(parts[1][1]).max())
    start = numpy.maximum([_ratio(*parts[0]), _ratio(*parts[1]), 0.95 * widest, 0.95 * fastest], 0.1)
    best, _ = search.descend(lambda p: float(numpy.abs(CommandPath(*p).applied(commands) - wheels).sum()), start, [0.1] * 4,
                             [10.0, 10.0, 2.0 * widest + 0.2, 2.0 * fastest + 0.2], [0.1, 0.1, 0.1 * widest + 0.01, 0.1 * fastest + 0.01],
                             2000)
    path = CommandPath(*(float(value) for value in best))
    return path._replace(forward_rate=_rate(recording, path, 0), difference_rate=_rate(recording, path, 1))


def applied_commands(recording, path):
    """Commands of the motors, shape (n, 2), NaN where unknown. A stretch begins with the speeds of its wheels."""
    goals, speeds = path.parts(recording.commands), CommandPath(largest_difference=math.inf).parts(recording.wheels)
    change = PERIOD * numpy.array([path.forward_rate, path.difference_rate])
    parts, now = numpy.full_like(goals, math.nan), numpy.zeros(2)
    for i, (starts, goal) in enumerate(zip(recording.starts, goals)):
        if starts:
            now = speeds[i]
        if not math.isnan(goal[0]):
            now = parts[i] = now + numpy.clip(goal - now, -change, change)
    return path.slowed(parts)


# ---- replay

def known_model(recording, commands, identified):
    """Plant model of the loop, identified from the first half of a recording or assumed, and the reason of a failed identification."""
    model, half = dict(robots.assumed_model(), sensor_rate=20.0), len(recording.time) // 2
    if not identified:
        return model, ''
    time, known = recording.time[:half, None], ~numpy.isnan(commands[:half, 0])
    yaw = numpy.hstack([time, recording.yaw_rate[:half, None]])[known] if recording.has_imu else None
    try:
        found = jackal_aic.identify(numpy.hstack([time, commands[:half]])[known], numpy.hstack([time, recording.wheels[:half]]), yaw,
                                    recording.wheel_radius)
    except ValueError as error:
        return model, str(error)
    if found.gain.unknown:
        return model, '{}: gain: {}'.format(recording.name, found.gain.unknown)
    tracks = [track.value for track in (found.track_left, found.track_right) if not track.unknown]
    if tracks:
        model['effective_track'] = sum(tracks) / len(tracks)
    offset = found.offset.value if not found.offset.unknown and found.offset.value > found.offset.half_width else 0.0
    model.update(identified=True, dead_time=found.dead_time.value, lag=found.lag.value, gain=found.gain.value, offset=offset,
                 acceleration_limit=found.acceleration_limit.value)
    return model, ''


def held_out(steps):
    """Which of the steps are held out."""
    return (steps >= 0) & (steps % 2 == 1)


def samples_of(recording, commands):
    """Rows (time, left, right, yaw rate, acceleration x, y, z, applied left and right, whether a stretch starts, whether it is held out)."""
    return numpy.column_stack([recording.time, recording.wheels, recording.yaw_rate, recording.acceleration, commands, recording.starts,
                               held_out(recording.step)])


def recorded_loop(recording, model):
    """`predictive` as a node runs it, with a plant model (keys of plant_model.*), on a robot that another controller drives."""
    keys = {'plant_model.' + key: value for key, value in model.items() if value != ''}
    keys.update({'robot.wheel_radius': recording.wheel_radius, 'robot.effective_track': TRACK_MULTIPLIER * recording.wheel_distance,
                 'robot.track_range': TRACK_RANGE,
                 'limits.linear_speed': 10.0, 'limits.angular_speed': 20.0, 'limits.wheel_speed': 200.0,
                 'limits.linear_acceleration': 0.0, 'limits.angular_acceleration': 0.0})
    return jackal_aic.DriveLoop(jackal_aic.Parameters('predictive', overrides=keys), motors_shared=True)


def watched(loop, recording, samples):
    """Passes samples (samples_of()) to a loop as a node would receive them. Returns the alarms, as (time [s], reason), the number of
    samples meanwhile, and the first report of a reversed gyro [s], or None."""
    alarms, alarmed, during, told, clock = [], False, 0, None, 0.0
    kinematics = jackal_aic.Kinematics(recording.wheel_radius, TRACK_MULTIPLIER * recording.wheel_distance)
    channels = ('left', 'right') + (('gyro', 'acceleration') if recording.has_imu else ())

    def advance(now):
        nonlocal alarmed, told
        loop.advance(now)
        before, alarmed = alarmed, loop.faulty or loop.fault == STUCK or loop.status not in ('driving', 'idle')
        if alarmed and not before:
            alarms.append((now, loop.reason))
        told = now if told is None and loop.fault == REVERSED else told

    for now, left, right, yaw_rate, x, y, z, *applied, starts, frozen in samples.tolist():
        if starts:
            loop.start(left, right, now)
            loop.release()
            clock = now
        while clock + TICK < now:
            clock += TICK
            advance(clock)
        loop.freeze_learning(bool(frozen), now)
        if math.isnan(applied[0]):
            applied = 0.0, 0.0
        else:
            loop.applied(*applied, now)
        forward, _, turn = kinematics.body_velocity(*applied)
        loop.set_set_point(forward, turn, now)
        loop.receive(jackal_aic.Observation(now, left, right, yaw_rate, x, y, z, channels), now)
        advance(now)
        during += alarmed
    return alarms, during, told


def replay(recording, path, identified, altered=None):
    """Figures of a recording through the drive loop: alarms, share of the time in alarm, and the error of the yaw rate in held-out steps / that of the best constant track.
    altered: a function of the samples (samples_of()) that returns those to replay."""
    commands = applied_commands(recording, path)
    model, refusal = known_model(recording, commands, identified)
    samples = samples_of(recording, commands)
    samples = altered(samples) if altered else samples
    loop, blocks = recorded_loop(recording, model), steady_blocks(recording)
    alarms, during, told = watched(loop, recording, samples)
    figures = {'recording': recording.name, 'refusal': refusal, 'model': 'identified' if identified else 'assumed',
               'alarms': alarms, 'alarmed': during / len(samples), 'reversed_told': told, 'yaw_error': None,
               'constant_error': None, 'samples': len(samples), 'duration': PERIOD * len(recording.time)}
    difference, turn, judged = recording.wheel_radius * _part(blocks.wheels, 1), blocks.yaw_rate, held_out(blocks.step)
    taught = ~judged
    if recording.has_imu and judged.any() and numpy.sum(difference[taught]**2) > 0.0:
        constant = numpy.sum(difference[taught] * turn[taught]) / numpy.sum(difference[taught]**2)
        ours = turn - numpy.array([loop.usual_yaw_rate(*wheels) for wheels in blocks.wheels])
        figures.update(yaw_error=metrics.rms(ours[judged]), constant_error=metrics.rms((turn - constant * difference)[judged]))
    return figures


def ratio(figures):
    """Error of the yaw rate over that of the best constant track; None without a gyro."""
    return None if not figures['constant_error'] else figures['yaw_error'] / figures['constant_error']


# ---- the table

COLUMNS = ('recording', 'model', 'duration_s', 'samples', 'gyro', 'false_alarms', 'time_in_fault_pct', 'yaw_error_radps',
           'best_constant_radps', 'ratio')


def row(item):
    """A row of the table with its figures."""
    path, identified = item
    recording = read(path)
    figures = replay(recording, fit_path(recording), identified)
    told = figures['reversed_told']
    gyro = 'none' if not recording.has_imu else 'as the wheels' if told is None else 'reversed, found after {:.0f} s'.format(told)
    cells = (recording.name, 'refused' if figures['refusal'] else figures['model'], round(figures['duration']), figures['samples'], gyro,
             len(figures['alarms']), *(None if value is None else round(value, digits) for value, digits in (
                 (100.0 * figures['alarmed'], 2), (figures['yaw_error'], 3), (figures['constant_error'], 3), (ratio(figures), 3))))
    return dict(zip(COLUMNS, cells)), figures


def write(directory, csv_file=None, jobs=0):
    """Prints the table, the alarms and their sum, and writes the table."""
    rows = engine.parallel(row, [(path, identified) for path in paths(directory) for identified in (False, True)], jobs, 'recordings')
    table = engine.frame([found for found, _ in rows], COLUMNS)
    print(engine.shown(table))
    for _, figures in rows:
        if figures['refusal']:
            print('{recording}: not identified: {refusal}'.format(**figures))
        for time, reason in figures['alarms']:
            print('{}, {}: {:.2f} s: {}'.format(figures['recording'], figures['model'], time, reason))
    if csv_file:
        engine.write(csv_file, engine.csv_text(table))
    worst = table['ratio'].astype(float).max()  # NaN without a gyro
    print('false alarms: {}; yaw error / best constant: worst {}'.format(
        table['false_alarms'].sum(), '-' if math.isnan(worst) else '{:.3f}'.format(worst)))
