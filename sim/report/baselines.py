"""The section of the report about published controllers of a plant with dead time, tuned under the same margins."""

from markup import cell, table
from results import read_rows

LIMIT = 1.6  # of Ms, in the table


def peak(row, column):
    """A peak of the sensitivity with a wrong dead time; infinite where the loop is unstable."""
    return cell('unstable' if row[column] == 'inf' else f'{float(row[column]):.2f}', style='no' if row[column] == 'inf' else '')


def at_equal_robustness(rows, driven):
    lines = []
    for row in rows:
        if float(row['ms_limit']) != LIMIT:
            continue
        drive = driven[(row['structure'], row['plant'])]
        lines.append([cell(row['plant'], True), cell(row['structure'], True),
                      cell(f'{float(row["ms"]):.2f}', style='' if row['kept'] == '1' else 'no'), cell(row['gain_margin']),
                      cell(f'{float(row["delay_margin_s"]):.2f}'), cell(f'{float(row["iae_of_bound"]):.2f}'),
                      cell(f'{float(row["noise_gain"]):.2f}'), peak(row, 'ms_half_dead_time'), peak(row, 'ms_longer_dead_time'),
                      *(cell(f'{float(drive[column]):.2f}')
                        for column in ('step_of_bound', 'gain_0.8_of_bound', 'gain_1.2_of_bound', 'load_of_bound'))])
    return table(['<plant', '<structure', 'Ms', 'gain margin', 'delay margin [s]', 'IAE / bound', 'noise', 'Ms, dead time × 0.5',
                  'Ms, × 1.5', '0.5 m/s', 'gain 0.8', 'gain 1.2', 'load'], lines,
                 [('', 2), ('linear', 7), ('driven, in multiples of the bound', 4)])


def section(directory):
    """What the section shows; None if the CSV files are not in the directory."""
    if not (directory / 'baselines.csv').exists() or not (directory / 'baselines_driven.csv').exists():
        return None
    rows = read_rows(directory / 'baselines.csv')
    driven = {(row['structure'], row['plant']): row for row in read_rows(directory / 'baselines_driven.csv')}
    return {'limit': LIMIT, 'table': at_equal_robustness(rows, driven)}
