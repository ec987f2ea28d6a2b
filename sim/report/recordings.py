"""The section of the report about recordings of real robots: false alarms, and the learned slip against the best constant track."""

from markup import cell, table
from results import read_rows

MODELS = {'assumed': 'as of any robot', 'identified': 'identified on the first half'}


def error_cells(row):
    """Error of the yaw rate, that of the best constant track and their ratio; empty if unknown."""
    for column in ('yaw_error_radps', 'best_constant_radps'):
        yield cell('' if row[column] == '-' else row[column])
    ratio = row['ratio']
    yield cell('' if ratio == '-' else ratio, style='yes' if ratio != '-' and float(ratio) < 1.0 else '')


def section(directory):
    """What the section shows; None if the CSV file is not in the directory."""
    if not (directory / 'real_drives.csv').exists():
        return None
    rows = read_rows(directory / 'real_drives.csv')
    lines = [[cell(row['recording'], True), cell(MODELS[row['model']], True), cell(f'{float(row["duration_s"]) / 60.0:.1f}'),
              cell(row['gyro'], True), cell(row['false_alarms'], style='yes' if row['false_alarms'] == '0' else 'no'),
              cell(row['time_in_fault_pct']), *error_cells(row)] for row in rows]
    return {'alarms': sum(int(row['false_alarms']) for row in rows),
            'table': table(['<recording', '<drive train', 'length [min]', '<gyro', 'number', 'time [%]', 'learned', 'best constant', 'ratio'],
                           lines, [('', 4), ('false alarms', 2), ('error of the yaw rate, held-out steps [rad/s]', 3)])}
