"""Fits the plants to the thesis' tables of step responses; writes the fitted keys of config/plant*.yaml."""

import functools
import math
import typing

import numpy
import scipy.optimize
import yaml

import engine
import metrics
import motions
import search
import thesis

DEAD_TIMES = (-0.002, 0.0, 0.002)  # s, added to the plant's; the fit has to hold for all
BANDS = (0.04, 0.05, 0.06)  # of the final value
MISSING = 1.0  # error of a figure that the thesis has and ours has not, and of a larger one


class Task(typing.NamedTuple):
    """A plant, its file, the tables it is fitted to, the tables whose trend counts too, and the ranges of the fitted keys."""

    plant: str
    file: str
    tables: tuple
    trends: tuple
    ranges: dict


TASKS = (Task('box', 'plant_box.yaml', ('5-1', '5-2', '5-4', '5-5', '5-6', '5-9'), ('5-4', '5-5', '5-9'),
              {'dead_time': (0.03, 0.16), 'motor_lag': (0.01, 0.12), 'velocity_loop_integral': (1.0, 30.0)}),
         Task('ground', 'plant.yaml', ('3-1a', '3-1b'), (),
              {'dead_time': (0.03, 0.2), 'motor_lag': (0.002, 0.12), 'velocity_loop_integral': (0.1, 30.0), 'acceleration_limit': (0.8, 10.0)}))


def responses(plant, item):
    """Settling and rise of a row on a plant without noise (overrides of plant.*), by dead time and band."""
    (row, integrator), shift = item
    overrides = dict(thesis.overrides_of(row, integrator), **plant)
    overrides.update({'plant.dead_time': plant['plant.dead_time'] + shift, 'plant.noise_scale': 0.0})
    motion = motions.step(row['step'])
    drive = engine.drive(row['plant'], row['controller'], motion, overrides, as_printed=True)
    found = [metrics.response(drive, motion, band) for band in BANDS]
    return [(response['settling_s'], response['rise_s']) for response in found]


def errors(row, settling, rise):
    """|ln(ours / thesis)| of the printed figures."""
    pairs = [(ours, row.get(name)) for ours, name in ((settling, 'settling'), (rise, 'rise'))]
    return [min(MISSING, abs(math.log(ours / theirs))) if ours else MISSING for ours, theirs in pairs if theirs]


def trend_error(rows, settlings):
    """Deviation of the changes of settling from row to row of a table from those of the thesis."""
    total, count = 0.0, 0
    for i, row in enumerate(rows):
        before = next((k for key in ('column', 'row') for k in range(i - 1, -1, -1)
                       if rows[k]['table'] == row['table'] and rows[k].get(key, '') == row.get(key, '')), None)
        if before is None or not rows[before].get('settling') or not row.get('settling'):
            continue
        theirs, ours = math.log(rows[before]['settling'] / row['settling']), (settlings[before], settlings[i])
        total += max(0.0, math.copysign(1.0, theirs) * (theirs - math.log(ours[0] / ours[1]))) if all(ours) else MISSING
        count += 1
    return total / count if count else 0.0


class Fit:
    """The cost of a plant: mean error of the tables and of their trends over dead times and bands."""

    def __init__(self, task, jobs):
        self.task, self.jobs = task, jobs
        self.items = [(row, thesis.comparable_integrator(row)) for table in task.tables for row in thesis.steps(table)]
        plant = engine.settings(task.plant, 'diff_drive')['plant']
        self.start = {key: plant[key] for key in task.ranges}
        self.low, self.high = numpy.log(list(task.ranges.values())).T

    def plant(self, logarithms):
        """Values of the keys, with three digits; the dead time in milliseconds."""
        values = dict(zip(self.task.ranges, numpy.exp(logarithms).tolist()))
        return {key: float('{:.3g}'.format(round(value, 3) if key == 'dead_time' else value)) for key, value in values.items()}

    def cost(self, logarithms):
        plant = {'plant.' + key: value for key, value in self.plant(logarithms).items()}
        found = engine.parallel(functools.partial(responses, plant), [(item, shift) for shift in DEAD_TIMES for item in self.items],
                                self.jobs, 'calibrate ' + self.task.plant)
        rows, total = [row for row, _ in self.items], 0.0
        for k in range(len(DEAD_TIMES)):
            for band in range(len(BANDS)):
                ours = [response[band] for response in found[k * len(rows):(k + 1) * len(rows)]]
                single = [error for row, figures in zip(rows, ours) for error in errors(row, *figures)]
                trend = [(row, figures[0]) for row, figures in zip(rows, ours) if row['table'] in self.task.trends]
                total += sum(single) / len(single) + trend_error([row for row, _ in trend], [settling for _, settling in trend])
        return total / (len(DEAD_TIMES) * len(BANDS))

    def descend(self, logarithms, evaluations):
        return search.descend(self.cost, logarithms, self.low, self.high, 0.05 * (self.high - self.low), evaluations)[0]

    def search(self, evaluations):
        """The plant of the least cost: over the whole range, then from the best and from the present plant."""
        population = 5 * len(self.low)
        globally = scipy.optimize.differential_evolution(
            self.cost, list(zip(self.low, self.high)), maxiter=max(0, evaluations // population - 1), popsize=5, seed=1, polish=False)
        starts = [globally.x, numpy.log(list(self.start.values()))]
        return self.plant(min((self.descend(start, evaluations // 2) for start in starts), key=self.cost))


def write(out, plant='all', evaluations=200, jobs=0):
    engine.require_range('evaluations', evaluations, 1, 100000)
    out = engine.directory(out)
    for task in TASKS:
        if plant not in ('all', task.plant):
            continue
        fit = Fit(task, jobs)
        found = fit.search(evaluations)
        engine.write(out / task.file, yaml.safe_dump({'plant': found}))
        print('{}: mean |ln(ours/thesis)| of tables and trends {:.3f}, before {:.3f}'.format(
            task.plant, *(fit.cost(numpy.log(list(values.values()))) for values in (found, fit.start))))
