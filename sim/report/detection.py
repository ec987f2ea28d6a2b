"""The section of the report about the fault monitor: what it finds and how fast, and what it says when there is nothing."""

from markup import cell, escape, table
from results import read_rows

BAR = 0.3  # s

INTRODUCTION = f'''
<p>The fault monitor in the closed loop without ROS (<code>experiments detection</code>). Each fault begins in steady driving, at
3 s; the bar is to find it within {BAR} s and to call it what it is. On a box the gyro cannot tell a dead encoder from a blocked
motor, and the monitor says what is worse.</p>
'''
ALARMS = '''
<p>Ordinary driving without a fault: steps, turns in place, arcs and square waves up to 1 m/s and 1 rad/s in random order, at once
one after the other. An outlier is one sample of which a channel was left out; a fault report is a false alarm, of which the bar
allows none.</p>
'''
MISSING = '<p>Not run: <code>experiments detection --out DIR</code> writes the data of this section.</p>'


def found_in_time(row):
    return row['found'] == row['expected'] and row['delay_s'] != '' and float(row['delay_s']) <= BAR + 1e-9


def delay_cell(row):
    text = row['delay_s'] or 'not found'
    wrong = '' if row['found'] in ('', row['expected']) else f' ({escape(row["found"])})'
    return cell(text + wrong, style='yes' if found_in_time(row) else 'no')


def delays(rows):
    """One row per controller, plant and fault, one column per motion."""
    motions = list(dict.fromkeys(row['motion'] for row in rows))
    by_case = {(row['controller'], row['plant'], row['fault'], row['motion']): row for row in rows}
    cases = list(dict.fromkeys((row['controller'], row['plant'], row['fault']) for row in rows))
    lines = []
    for case in cases:
        first = by_case[(*case, motions[0])]
        words = [cell(escape(word), True) for word in (*case, first['expected'])]
        lines.append(words + [delay_cell(by_case[(*case, motion)]) for motion in motions])
    return table(['<controller', '<plant', '<fault', '<is called'] + [f'{motion} [s]' for motion in motions], lines)


def alarms(rows):
    lines = []
    for row in rows:
        words = [cell(escape(row[name]), True) for name in ('controller', 'plant', 'condition')]
        share = 100.0 * int(row['outliers']) / int(row['samples'])
        verdict = cell('none' if not row['fault'] else escape(row['fault']), True, 'no' if row['fault'] else 'yes')
        lines.append(words + [cell(row['duration_s']), cell(f'{share:.3f}'), verdict])
    return table(['<controller', '<plant', '<condition', 'driving [s]', 'outliers [%]', '<false alarm'], lines)


def section(directory):
    """HTML of the section; the CSV files in the directory may not exist."""
    heading = '<h2 id="detection">Fault detection</h2>'
    if not (directory / 'detection.csv').exists() or not (directory / 'alarms.csv').exists():
        return heading + MISSING
    found, quiet = read_rows(directory / 'detection.csv'), read_rows(directory / 'alarms.csv')
    in_time = sum(1 for row in found if found_in_time(row))
    slowest = max((float(row['delay_s']) for row in found if row['delay_s']), default=0.0)
    return (f'{heading}{INTRODUCTION}<p>{in_time} of {len(found)} found in time, the slowest after {slowest:.2f} s.</p>'
            f'<div class="wide">{delays(found)}</div>{ALARMS}{alarms(quiet)}')
