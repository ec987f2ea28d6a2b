"""The section of the report about odometry: its drift and that of the stock controller."""

from markup import cell, table
from results import read_rows

# heading of the group, prefix of its columns
ODOMETRIES = (('ours', ''), ('stock: wheels', 'stock_'))


def drift_cells(row):
    """Drift and error of the heading of each odometry; the least drift of a row in green."""
    least = min(float(row[prefix + 'drift_m_per_m']) for _, prefix in ODOMETRIES)
    for _, prefix in ODOMETRIES:
        drift = float(row[prefix + 'drift_m_per_m'])
        yield cell(f'{1e3 * drift:.2f}', style='yes' if drift == least else '')
        yield cell(f'{float(row[prefix + "heading_error_rad"]):.3f}')


def section(directory):
    """What the section shows; None if the CSV file is not in the directory."""
    if not (directory / 'odometry.csv').exists():
        return None
    lines = []
    for row in read_rows(directory / 'odometry.csv'):
        lines.append([cell(row['controller'], True), cell(row['drive'], True), cell(f'{float(row["way_m"]):.0f}'), *drift_cells(row),
                      cell(f'{float(row["nees"]):.2f}'), cell(f'{100.0 * float(row["inside_95"]):.1f}')])
    headings = ['<controller', '<drive', 'way [m]'] + ['drift [mm/m]', 'heading [rad]'] * len(ODOMETRIES) + ['NEES', 'inside 95 % [%]']
    return table(headings, lines, [('', 3)] + [(words, 2) for words, _ in ODOMETRIES] + [('covariance of ours', 2)])
