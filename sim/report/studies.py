"""The sections of the report that show the CSV files of a study as they are, below what they hold."""

from results import read_rows


def found_in_time(results, rows):
    bars = results.bars['detection']
    named = sum(row['found'] == row['expected'] and row['delay_s'] != '' and
                float(row['delay_s']) <= bars['delay_on_real' if row['plant'] == 'real' else 'delay'] + 1e-9 for row in rows)
    return f'{named} of {len(rows)} named in time, which is {bars["delay"]} s.'


def passed(results, rows):
    return f'{sum(row["result"] == "passed" for row in rows)} of {len(rows)} scenarios passed.'


def alarms(results, rows):
    return f'{sum(int(row["false_alarms"]) for row in rows)} false alarms.'


# Anchor, title, command, words, and each file with what sums it up.
STUDIES = (
    ('baselines', 'Published controllers', 'experiments baselines --out DIR',
     'Controllers for a plant with dead time, each tuned by the same search: least integral of the absolute error (IAE) after a disturbance '
     'of the motors, with a gain margin of 2, a delay margin of 0.05 s and a peak of the sensitivity Ms of at most 1.6. predictive_preset is '
     'not tuned. All follow the same path, so a step on a robot that is its model is the same for all. The bound is the least IAE with this '
     'dead time and sampling, on the linear drive train.', (('baselines.csv', None),)),
    ('odometry', 'Odometry', 'experiments odometry --out DIR',
     'Error of the position at the end of a drive per metre, and of the heading, of ours and of the stock controller, which counts the turns '
     'of the wheels on an effective track. NEES is the normalised estimation error squared of ours: 2 is exact, less is too careful.',
     (('odometry.csv', None),)),
    ('detection', 'Fault detection', 'experiments detection --out DIR',
     'Each fault begins in steady driving at 3 s. On a box the gyro cannot tell a dead encoder from a blocked motor, and the graver one is '
     'named. The second table is ordinary driving without a fault, where every report is a false alarm.',
     (('detection.csv', found_in_time), ('alarms.csv', None))),
    ('recordings', 'Recordings of real robots', 'experiments real --data DIR --csv real_drives.csv',
     'Skid-steer robots of other sizes without a fault, replayed through the drive loop, with the assumed drive train and with the one '
     'identified on the first half. The loop learns from every other step. On the others, its error of the yaw rate is compared with that of '
     'the best constant effective track.', (('real_drives.csv', alarms),)),
    ('faults', 'Faults', './scripts/faults',
     'Each scenario ran through the real nodes and a node that injects faults between them; ground truth is the judge. Standstill is counted '
     'from the onset of the fault. Acceleration and limit are parts of what the gate allows: neither may exceed 1.',
     (('../faults.csv', passed),)))


def sections(results):
    """Each study; without tables if it has not been run."""
    for name, title, command, words, files in STUDIES:
        tables = []
        for file, summary in files:
            if (results.directory / file).exists():
                rows = read_rows(results.directory / file)
                tables.append({'summary': summary(results, rows) if summary else '', 'table': [{column.replace('_', ' '): value for column, value in row.items()} for row in rows]})
        yield {'name': name, 'title': title, 'command': command, 'words': words, 'tables': tables}
