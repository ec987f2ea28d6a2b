"""The section of the report about the fault campaign: every scenario, from the CSV file that ./scripts/faults writes."""

from markup import cell, escape, table
from results import read_rows

INTRODUCTION = '''
<p>Each scenario ran through the real nodes: the simulated robot, the controller, and between them a node that puts faults into
what they say to each other. The verdict is from ground truth. <b>Standstill</b> is counted from the onset of the fault. Its bar
is 1.2 × (the configured time until the brake begins + the time to brake) + the robot's dead time; the time to brake is the
gate's, or the robot's own where its motors are slower. <b>Acceleration</b> is the largest change of the drive command from one
period to the next and <b>limit</b> the largest drive command, both as parts of what the gate allows: neither may exceed 1.
<b>Overspeed</b> is beyond the speed at the onset and the set point. Where the robot is to stop, the distance is that until
standstill, else that driven while the fault lasts.</p>
'''
MISSING = '<p>Not run: <code>./scripts/faults</code> writes results/faults.csv, which this section shows.</p>'


def figure(text, digits=2):
    return cell(f'{float(text):.{digits}f}' if text else '–')


def row_of(scenario):
    passed = scenario['result'] == 'passed'
    verdict = 'passed' if passed else f'failed: {scenario["failures"]}'
    words = [cell(escape(scenario[name]), True) for name in ('scenario', 'faults', 'expected')]
    figures = [figure(scenario[name]) for name in ('distance_m', 'standstill_s', 'allowed_s', 'command_step_radps',
                                                   'acceleration_use', 'limit_use', 'overspeed_mps', 'detected_s')]
    return words + figures + [cell(escape(scenario['told']), True, 'note'), cell(escape(verdict), True, 'yes' if passed else 'no')]


def section(path):
    """HTML of the section; path is that of the CSV file, which may not exist."""
    heading = '<h2 id="faults">Faults</h2>'
    if not path.exists():
        return heading + MISSING
    scenarios = read_rows(path)
    passed = sum(1 for scenario in scenarios if scenario['result'] == 'passed')
    headings = ['<scenario', '<faults', '<expected', 'distance [m]', 'standstill [s]', 'bar [s]', 'step [rad/s]', 'acceleration',
                'limit', 'overspeed [m/s]', 'detected [s]', '<told', '<verdict']
    return (f'{heading}{INTRODUCTION}<p>{passed} of {len(scenarios)} scenarios passed.</p>'
            f'<div class="wide">{table(headings, [row_of(scenario) for scenario in scenarios])}</div>')
