"""Recordings of real skid-steer robots through the drive loop: false alarms, and the learned turn.

Two kinds of CSV files, told apart by their columns: logs, in which the command is known only while `state` is `calib`, and windows of
2 s, in the order of time within a calib_step. Speeds of wheels are in rad/s; sides are (left, right).
"""

import collections
import csv
import math
import pathlib
import typing

import jackal_aic
import numpy

import engine
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

Sample = collections.namedtuple('Sample', 'time left right yaw_rate ax ay az heading command step steady starts')
Block = collections.namedtuple('Block', 'step command wheels yaw_rate')


class Recording(typing.NamedTuple):
    name: str
    wheel_radius: float
    wheel_distance: float
    has_imu: bool
    gyro_reversed: bool  # the file's gyro has the other sign; the samples are corrected
    samples: list

    def column(self, name):
        return numpy.array([getattr(sample, name) for sample in self.samples], float)

    def commands(self):
        """Recorded commands, shape (n, 2), NaN where they are not known."""
        return numpy.array([sample.command or (math.nan, math.nan) for sample in self.samples])

    def duration(self):
        return PERIOD * len(self.samples)


# ---- reading

def _rows(path):
    """Columns and rows of a file; the rows are dicts of numbers, with the line and the text of `state`."""
    with open(path, newline='') as file:
        reader = csv.DictReader(file)
        rows = [{name: text if name == 'state' else float(text) for name, text in dict(row, line=reader.line_num).items()} for row in reader]
    if reader.fieldnames not in (LOG, WINDOWS):
        raise ValueError('columns of no known kind of recording; a log begins with time_s, state, windows with window, calib_step')
    return reader.fieldnames, rows


def _sensors(row):
    return (row['wheel_left_radps'], row['wheel_right_radps'], row['gyro_z_radps'], row['accel_x_mps2'], row['accel_y_mps2'],
            row['accel_z_mps2'], row['lidar_yaw_rad'])


def _read_log(rows, radius, distance):
    samples, since, wanted, step = [], 0.0, None, -1
    for row in rows:
        time, known, last = row['time_s'], row['state'] == 'calib', samples[-1] if samples else None
        if last and time <= last.time:
            raise ValueError('line {:g}: time_s = {:g}: must be above {:g}, that of the row before'.format(row['line'], time, last.time))
        starts = last is None or known != (last.command is not None) or time - last.time > LONGEST_GAP
        new = (row['command_forward_mps'], row['command_yaw_radps'])
        if known and (starts or new != wanted):
            step, since = step + 1, time
        wanted = new
        half = 0.5 * distance * new[1]
        command = ((new[0] - half) / radius, (new[0] + half) / radius) if known else None
        samples.append(Sample(time, *_sensors(row), command, step if known else -1, known and time - since >= STEADY, starts))
    return samples


def _read_windows(rows):
    samples, window, begin, before = [], None, 0.0, 0.0
    for row in rows:
        time, number, step = row['time_s'], int(row['window']), int(row['calib_step'])
        new, first = number != window, not samples
        if not 0.0 <= time < WINDOW or (not new and time <= before):
            raise ValueError('line {:g}: time_s = {:g}: must be in [0, {:g}) and increase in a window'.format(row['line'], time, WINDOW))
        starts = first or (new and number != window + 1) or step != samples[-1].step
        if new and not first:
            begin += WINDOW + (PAUSE if starts else 0.0)
        window, before = number, time
        samples.append(Sample(begin + time, *_sensors(row), (row['cmd_left_radps'], row['cmd_right_radps']), step,
                              row['steady'] != 0.0, starts))
    return samples


def _gyro_reversed(samples):
    """True if the gyro, and not the wheels against their commands, has the wrong sign."""
    together = sum(s.yaw_rate * (s.right - s.left) for s in samples)
    followed = sum((s.command[1] - s.command[0]) * (s.right - s.left) for s in samples if s.command)
    return together < 0.0 <= followed


def read(path):
    """A recording from a file. Raises ValueError with file and reason."""
    name = pathlib.Path(path).stem
    known = [robot for robot in ROBOTS if name.startswith(robot)]
    if not known:
        raise ValueError("'{}': begins with the name of no known robot; known: {}".format(path, ', '.join(ROBOTS)))
    radius, distance = ROBOTS[known[0]]
    try:
        columns, rows = _rows(path)
        samples = _read_log(rows, radius, distance) if columns == LOG else _read_windows(rows)
    except (OSError, TypeError, ValueError, csv.Error) as error:
        raise ValueError("'{}': {}".format(path, error)) from error
    if not samples:
        raise ValueError("'{}': has no rows".format(path))
    reversed_gyro = _gyro_reversed(samples)
    if reversed_gyro:
        samples = [s._replace(yaw_rate=-s.yaw_rate) for s in samples]
    return Recording(name, radius, distance, any(s.yaw_rate != 0.0 or s.az != 0.0 for s in samples), reversed_gyro, samples)


def paths(directory):
    """Recordings of a directory by name."""
    found = sorted(str(path) for path in pathlib.Path(directory).glob('*.csv') if path.is_file())
    if not found:
        raise ValueError("data = '{}': holds no file *.csv".format(directory))
    return found


def steady_blocks(recording):
    """Means over the steady pieces of the steps, in order; the yaw rate is by the gyro, or else by lidar."""
    blocks, piece = [], []
    for sample in recording.samples:
        if piece and (sample.starts or sample.step != piece[-1].step):
            piece = []
        if not sample.steady or sample.command is None:
            piece = []
            continue
        piece.append(sample)
        if len(piece) < BLOCK:
            continue
        if recording.has_imu:
            turn = sum(s.yaw_rate for s in piece) / BLOCK
        else:
            turn = sum(math.remainder(b.heading - a.heading, 2.0 * math.pi) for a, b in zip(piece, piece[1:])) / PERIOD / (BLOCK - 1)
        blocks.append(Block(sample.step, sample.command, (sum(s.left for s in piece) / BLOCK, sum(s.right for s in piece) / BLOCK), turn))
        piece = []
    return blocks


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
        commands = numpy.asarray(commands)
        return numpy.stack([self.forward_gain * commands.mean(axis=-1),
                            numpy.clip(self.yaw_gain * (commands[..., 1] - commands[..., 0]), -self.largest_difference,
                                       self.largest_difference)], axis=-1)

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
    sides = numpy.asarray(sides)
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
    measured = _part(numpy.stack([recording.column('left'), recording.column('right')], axis=1), index)
    wanted = path.parts(recording.commands())[:, index]
    change = (rates * PERIOD)[:, None]
    now, error, begin = numpy.zeros((len(rates), len(delays))), numpy.zeros((len(rates), len(delays))), 0
    for i, sample in enumerate(recording.samples):
        if sample.starts:
            begin = i
            now[:] = measured[i]
        if sample.command is None:
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
    if len(blocks) < 8:
        return CommandPath()
    commands, wheels = (numpy.array([getattr(block, name) for block in blocks]) for name in ('command', 'wheels'))
    parts = [(_part(commands, i), _part(wheels, i)) for i in (0, 1)]
    if any(numpy.sum(commanded * done) < 0.05 * numpy.sum(commanded**2) for commanded, done in parts):
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
    goals = path.parts(recording.commands())
    change = PERIOD * numpy.array([path.forward_rate, path.difference_rate])
    parts, now = numpy.full_like(goals, math.nan), numpy.zeros(2)
    for i, sample in enumerate(recording.samples):
        if sample.starts:
            now = CommandPath(largest_difference=math.inf).parts((sample.left, sample.right))
        if sample.command is not None:
            now = now + numpy.clip(goals[i] - now, -change, change)
            parts[i] = now
    return path.slowed(parts)


# ---- replay

def identify(recording, commands, end=None):
    """jackal_aic.identify() on the samples with known commands before one of them."""
    time, known = recording.column('time')[:end], ~numpy.isnan(commands[:end, 0])
    wheels = numpy.stack([time, recording.column('left')[:end], recording.column('right')[:end]], axis=1)
    yaw = numpy.stack([time, recording.column('yaw_rate')[:end]], axis=1)[known] if recording.has_imu else None
    return jackal_aic.identify(numpy.column_stack([time, commands[:end]])[known], wheels[known], yaw, recording.wheel_radius)


def known_model(recording, commands, identified):
    """Plant model of the loop, and the reason of a failed identification."""
    model = dict(robots.assumed_model(), sensor_rate=20.0)
    if not identified:
        return model, ''
    try:
        found = identify(recording, commands, len(recording.samples) // 2)
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


def held_out(step):
    """The held-out steps."""
    return step >= 0 and step % 2 == 1


def reversed_gyro(samples):
    samples[:, 3] *= -1.0
    return samples


def replay(recording, path, identified, altered=None):
    """Figures of a recording through the drive loop: alarms, share of the time in alarm, and the error of the yaw rate in held-out steps / that of the best constant track.
    altered: a function of the samples (jackal_aic._core.replay_recording) that returns those to replay."""
    commands = applied_commands(recording, path)
    model, refusal = known_model(recording, commands, identified)
    samples = numpy.array([(s.time, s.left, s.right, s.yaw_rate, s.ax, s.ay, s.az, *command,
                            (1 if s.starts else 0) + (2 if held_out(s.step) else 0))
                           for s, command in zip(recording.samples, commands)])
    samples = altered(samples) if altered else samples
    blocks = steady_blocks(recording)
    difference = numpy.array([recording.wheel_radius * (b.wheels[1] - b.wheels[0]) for b in blocks])
    speed = numpy.array([0.5 * recording.wheel_radius * (b.wheels[0] + b.wheels[1]) for b in blocks])
    turn, judged = numpy.array([b.yaw_rate for b in blocks]), numpy.array([held_out(b.step) for b in blocks], bool)
    found = jackal_aic.replay_recording(samples, recording.wheel_radius, recording.wheel_distance, model, recording.has_imu,
                                        numpy.column_stack([difference, speed]).reshape(-1, 2))
    figures = {'recording': recording.name, 'refusal': refusal, 'model': 'identified' if identified else 'assumed',
               'alarms': found['alarms'], 'alarmed': found['alarmed'] / len(samples), 'reversed_told': found['reversed_told'],
               'turn': found['turn'], 'yaw_error': None, 'constant_error': None, 'samples': len(samples),
               'duration': recording.duration()}
    taught = ~judged
    if recording.has_imu and judged.any() and numpy.sum(difference[taught]**2) > 0.0:
        constant = numpy.sum(difference[taught] * turn[taught]) / numpy.sum(difference[taught]**2)
        ours = turn - numpy.array(found['usual_yaw_rates'])
        figures['yaw_error'] = float(numpy.sqrt(numpy.mean(ours[judged]**2)))
        figures['constant_error'] = float(numpy.sqrt(numpy.mean((turn - constant * difference)[judged]**2)))
    return figures


def ratio(figures):
    """Error of the yaw rate over that of the best constant track; None without a gyro."""
    return None if not figures['constant_error'] else figures['yaw_error'] / figures['constant_error']


# ---- the table

COLUMNS = ('recording', 'model', 'duration_s', 'samples', 'gyro', 'false_alarms', 'time_in_fault_pct', 'yaw_error_radps',
           'best_constant_radps', 'ratio')


def _decimals(value):
    return '-' if value is None else '{:.3f}'.format(value)


def _gyro(recording, identified, path):
    """Column gyro; a reversed gyro has to be detected."""
    if not recording.gyro_reversed:
        return 'as the wheels' if recording.has_imu else 'none'
    found = replay(recording, path, identified, reversed_gyro)['reversed_told']
    return 'reversed, not found' if found is None else 'reversed, found after {:.0f} s'.format(found)


def row(item):
    """A row of the table with its figures."""
    path, identified = item
    recording = read(path)
    command_path = fit_path(recording)
    figures = replay(recording, command_path, identified)
    cells = (recording.name, 'refused' if figures['refusal'] else figures['model'], '{:.0f}'.format(figures['duration']),
             str(figures['samples']), _gyro(recording, identified, command_path), str(len(figures['alarms'])),
             '{:.2f}'.format(100.0 * figures['alarmed']), _decimals(figures['yaw_error']), _decimals(figures['constant_error']),
             _decimals(ratio(figures)))
    return cells, figures


def write(directory, csv_file=None, jobs=0):
    """Prints the table, the alarms and their sum, and writes the table."""
    rows = engine.parallel(row, [(path, identified) for path in paths(directory) for identified in (False, True)], jobs, 'recordings')
    print(engine.aligned([COLUMNS] + [cells for cells, _ in rows]))
    for _, figures in rows:
        if figures['refusal']:
            print('{recording}: not identified: {refusal}'.format(**figures))
        for time, reason in figures['alarms']:
            print('{}, {}: {:.2f} s: {}'.format(figures['recording'], figures['model'], time, reason))
    if csv_file:
        engine.write(csv_file, engine.text_of(COLUMNS, [cells for cells, _ in rows]))
    ratios = [ratio(figures) for _, figures in rows if ratio(figures) is not None]
    print('false alarms: {}; yaw error / best constant: worst {}'.format(
        sum(len(figures['alarms']) for _, figures in rows), _decimals(max(ratios) if ratios else None)))
