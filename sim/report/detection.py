"""The section of the report about the fault monitor: what it finds and how fast, and what it says when there is nothing."""

from markup import cell, table
from results import read_bars, read_rows

def found_in_time(row, bars):
    bar = bars['delay_on_real' if row['plant'] == 'real' else 'delay']
    return row['found'] == row['expected'] and row['delay_s'] != '' and float(row['delay_s']) <= bar + 1e-9


def delay_cell(row, bars):
    text = row['delay_s'] or 'not found'
    wrong = '' if row['found'] in ('', row['expected']) else f' ({row["found"]})'
    return cell(text + wrong, style='yes' if found_in_time(row, bars) else 'no')


def delays(rows, bars):
    """One row per controller, plant and fault, one column per motion."""
    motions = list(dict.fromkeys(row['motion'] for row in rows))
    by_case = {(row['controller'], row['plant'], row['fault'], row['motion']): row for row in rows}
    cases = list(dict.fromkeys((row['controller'], row['plant'], row['fault']) for row in rows))
    lines = []
    for case in cases:
        first = by_case[(*case, motions[0])]
        words = [cell(word, True) for word in (*case, first['expected'])]
        lines.append(words + [delay_cell(by_case[(*case, motion)], bars) for motion in motions])
    return table(['<controller', '<plant', '<fault', '<is called'] + [f'{motion} [s]' for motion in motions], lines)


def alarms(rows):
    lines = []
    for row in rows:
        words = [cell(row[name], True) for name in ('controller', 'plant', 'condition')]
        share = 100.0 * int(row['outliers']) / int(row['samples'])
        verdict = cell('none' if not row['fault'] else row['fault'], True, 'no' if row['fault'] else 'yes')
        lines.append(words + [cell(row['duration_s']), cell(f'{share:.3f}'), verdict])
    return table(['<controller', '<plant', '<condition', 'driving [s]', 'outliers [%]', '<false alarm'], lines)


def section(package, directory):
    """What the section shows; None if the CSV files are not in the directory."""
    if not (directory / 'detection.csv').exists() or not (directory / 'alarms.csv').exists():
        return None
    found, quiet = read_rows(directory / 'detection.csv'), read_rows(directory / 'alarms.csv')
    bars = read_bars(package)['detection']
    return {'bar': bars['delay'], 'in_time': sum(1 for row in found if found_in_time(row, bars)), 'cases': len(found),
            'slowest': max((float(row['delay_s']) for row in found if row['delay_s']), default=0.0),
            'delays': delays(found, bars), 'alarms': alarms(quiet)}
