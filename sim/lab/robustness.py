"""A step on random robots (robots.py)."""

import engine
import metrics
import motions
import robots

COLUMNS = ('controller', 'seed', 'bounded', 'settling_s', 'open_loop_settling_s', 'steady_error_pct', 'belief_bias_pct')


def step(controller, robot):
    """A step to 0.5 m/s by a controller that knows the mean radius of the tyres and the drive train of plant_real.yaml."""
    motion = motions.step(0.5)
    radius = 0.5 * (robot['plant.wheel_radius_left'] + robot['plant.wheel_radius_right'])
    section = 'diff_drive' if controller == 'diff_drive' else 'robot'
    drive = engine.drive('real', controller, motion, dict(robot, **{section + '.wheel_radius': radius}))
    row = metrics.response(drive, motion)
    return dict(row, **metrics.errors(drive, motion)) if row['bounded'] else row


def drawn(item):
    """A row: a controller and the open loop on the robot of a seed."""
    controller, seed = item
    robot = robots.reality(seed)
    row = step(controller, robot)
    open_loop = row if controller == 'diff_drive' else step('diff_drive', robot)
    return dict(row, controller=controller, seed=seed, open_loop_settling_s=open_loop['settling_s'])


def keeps(row):
    """Which bars a bounded row keeps: settled, exact, believed. If the open loop does not settle, settling has no bar."""
    asked, open_loop, settling = engine.bars()['robustness'], row['open_loop_settling_s'], row['settling_s']
    soon = open_loop is None or (settling is not None and
                                 settling <= asked['settling_factor'] * open_loop + asked['settling_margin'])
    return {'settled': soon, 'exact': abs(row['steady_error_pct']) <= asked['steady_error'],
            'believed': abs(row.get('belief_bias_pct') or 0.0) <= asked['belief_error']}


def summary(rows):
    """Numbers of unstable rows, and of rows that keep each bar."""
    bounded = [keeps(row) for row in rows if row['bounded']]
    return dict({bar: sum(kept[bar] for kept in bounded) for bar in ('settled', 'exact', 'believed')},
                unstable=len(rows) - len(bounded), runs=len(rows))


def write(out, draws, seed, jobs=0):
    engine.require_range('draws', draws, 1, 1000000)
    asked = engine.bars()['robustness']
    items = [(controller, seed + i) for controller in engine.CONTROLLERS for i in range(draws)]
    rows = engine.parallel(drawn, items, jobs, 'robustness')
    engine.save(out, 'robustness.csv', rows, COLUMNS)
    for controller in engine.CONTROLLERS:
        sums = summary([r for r in rows if r['controller'] == controller])
        print('{}: {unstable} of {runs} unstable; settled in {:g} x open loop + {:g} s: {settled}; steady-state error within {:g} %: '
              '{exact}; belief within {:g} %: {believed}'.format(controller, asked['settling_factor'], asked['settling_margin'],
                                                                 asked['steady_error'], asked['belief_error'], **sums))
