"""Drift of the odometry and of the stock controller's per metre, and the share of errors within their own 95 % bounds."""

import math

import numpy

import engine
import metrics
import motions
import robots

STOCK_TRACK = 0.563385  # m, 1.5 times the distance between the wheels
GROUNDS = {'': {}, ' on friction 0.3': {'plant.friction': 0.3}, ' on friction 0.8': {'plant.friction': 0.8},
           ' with 15 kg': {'plant.payload': 15.0}}
COLUMNS = ('controller', 'drive', 'way_m', 'drift_m_per_m', 'heading_error_rad', 'stock_drift_m_per_m', 'stock_heading_error_rad',
           'nees', 'inside_95')
SQUARE = ((6.0, 0.5, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.25 * math.pi), (1.0, 0.0, 0.0))
DRIVES = {'straight line': motions.segments([(30.0, 0.8, 0.0)]), 'square': motions.segments(4 * SQUARE),
          'circles': motions.segments([(40.0, 0.5, 0.5)]), 'eight': motions.segments([(12.5, 0.6, 0.5), (12.5, 0.6, -0.5)]),
          'driving cycle': motions.cycle(7)}

SEEDS = 20
UNSTEADY = 1.5  # s after a change of the set point
PHASES = ('standing', 'steady', 'transient')
BELIEF_COLUMNS = ('plant', 'phase', 'nees', 'nees_forward', 'nees_yaw_rate', 'inside_95')


def stock(drive, radius):
    """Pose (x, y, heading) of the stock controller's odometry: wheel speeds integrated on arcs."""
    left, right = numpy.diff(radius * drive.wheel_position_left), numpy.diff(radius * drive.wheel_position_right)
    turns = (right - left) / STOCK_TRACK
    headings = numpy.concatenate([[0.0], numpy.cumsum(turns)])
    chords = 0.5 * (left + right) * numpy.sinc(0.5 * turns / numpy.pi)  # of the arcs
    middle = headings[:-1] + 0.5 * turns
    return numpy.sum(chords * numpy.cos(middle)), numpy.sum(chords * numpy.sin(middle)), headings[-1]


def drift(pose, drive, way):
    """Position error per metre and heading error [rad] at the end of a drive."""
    x, y, heading = pose
    error = math.hypot(x - drive.x[-1], y - drive.y[-1])
    return error / way if way > 0.0 else 0.0, abs(math.remainder(heading - drive.heading[-1], 2.0 * math.pi))


def row(item):
    """A row: a controller, the name of a drive, on a ground."""
    controller, name, ground = item
    drive = engine.drive('ground', controller, DRIVES[name], GROUNDS[ground], odometry=True)
    values = engine.settings('ground', controller, GROUNDS[ground])
    way = float(motions.TICK * numpy.sum(numpy.abs(drive.speed)))
    ours = drift((drive.odometry_x[-1], drive.odometry_y[-1], drive.odometry_heading[-1]), drive, way)
    theirs = drift(stock(drive, values['geometry']['wheel_radius']), drive, way)
    looked = (numpy.arange(len(drive.time)) % 10 == 5) & (drive.time >= motions.REST)
    nees = metrics.normalised_error(drive.odometry_speed - drive.speed, drive.odometry_yaw_rate - drive.yaw_rate,
                                    drive.odometry_speed_variance, drive.odometry_covariance, drive.odometry_yaw_rate_variance)[looked]
    return dict(zip(COLUMNS, (controller, name + ground, way, *ours, *theirs, float(numpy.mean(nees)),
                              float(numpy.mean(nees < metrics.INSIDE_95)))))


# ---- the covariance of the belief

def drives_and_stops(seed):
    """A driving cycle that stops for three seconds after every segment."""
    drives = motions.cycle(seed, segments=6, shortest=3.0, longest=5.0)
    ends = [point[0] for point in drives.set_points[1:]] + [drives.duration]
    points, stops = [], 0.0
    for (time, *set_point), end in zip(drives.set_points, ends):
        points += [(time + stops, *set_point), (end + stops, 0.0, 0.0)]
        stops += 3.0
    return motions.Motion(tuple(points), drives.duration + stops)


def phases(drive):
    """Index in PHASES of each instant."""
    changed = metrics.set_point_changes(drive)
    since = numpy.append(-numpy.inf, drive.time[changed])[numpy.searchsorted(changed, numpy.arange(len(drive.time)), side='right')]
    stands = (drive.set_speed == 0.0) & (drive.set_yaw_rate == 0.0)
    return numpy.where(drive.time - since < UNSTEADY - 1e-9, 2, numpy.where(stands, 0, 1))


def consistency(item):
    """Normalised squared errors by phase, (all, forward, yaw rate), of a drive by `predictive` on a plant ('drawn': a drawn robot)."""
    plant, seed = item
    robot, overrides = ('real', robots.reality(seed)) if plant == 'drawn' else (plant, {'plant.seed': seed})
    drive = engine.drive(robot, 'predictive', drives_and_stops(seed), overrides, odometry=True)
    errors = drive.believed_speed - drive.speed, drive.believed_yaw_rate - drive.yaw_rate
    nees = metrics.normalised_error(*errors, drive.believed_speed_variance, drive.believed_covariance, drive.believed_yaw_rate_variance)
    single = errors[0]**2 / drive.believed_speed_variance, errors[1]**2 / drive.believed_yaw_rate_variance
    phase = numpy.where((numpy.arange(len(drive.time)) % 10 == 5) & (drive.time >= motions.REST), phases(drive), -1)
    return [(nees[phase == p], single[0][phase == p], single[1][phase == p]) for p in range(len(PHASES))]


def consistency_rows(plant, seeds, jobs=0):
    """Rows of a plant, one a phase, over the drives of some seeds."""
    drives = engine.parallel(consistency, [(plant, seed) for seed in seeds], jobs, 'belief on ' + plant)
    rows = []
    for index, phase in enumerate(PHASES):
        nees, forward, yaw_rate = (numpy.concatenate([found[index][i] for found in drives]) for i in range(3))
        figures = (plant, phase, numpy.mean(nees), numpy.mean(forward), numpy.mean(yaw_rate), numpy.mean(nees < metrics.INSIDE_95))
        rows.append(dict(zip(BELIEF_COLUMNS, figures), samples=len(nees)))
    return rows


def write(out, jobs=0):
    items = [(controller, name, ground) for controller in ('predictive', 'improved') for name in DRIVES for ground in GROUNDS]
    engine.save(out, 'odometry.csv', engine.parallel(row, items, jobs, 'odometry'), COLUMNS)


def write_belief(out, jobs=0):
    rows = [found for plant in ('box', 'ground', 'real', 'drawn') for found in consistency_rows(plant, range(1, SEEDS + 1), jobs)]
    engine.save(out, 'belief.csv', rows, BELIEF_COLUMNS)
