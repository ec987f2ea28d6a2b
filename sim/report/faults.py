"""The section of the report about the fault campaign: every scenario, from the CSV file that ./scripts/faults writes."""

from markup import cell, table
from results import read_rows

def figure(text, digits=2):
    return cell(f'{float(text):.{digits}f}' if text else '–')


def row_of(scenario):
    passed = scenario['result'] == 'passed'
    verdict = 'passed' if passed else f'failed: {scenario["failures"]}'
    words = [cell(scenario[name], True) for name in ('scenario', 'faults', 'expected')]
    figures = [figure(scenario[name]) for name in ('distance_m', 'standstill_s', 'allowed_s', 'command_step_radps',
                                                   'acceleration_use', 'limit_use', 'overspeed_mps', 'detected_s')]
    return words + figures + [cell(scenario['told'], True, 'note'), cell(verdict, True, 'yes' if passed else 'no')]


def section(path):
    """Content of the section; None without a CSV file."""
    if not path.exists():
        return None
    scenarios = read_rows(path)
    headings = ['<scenario', '<faults', '<expected', 'distance [m]', 'standstill [s]', 'bar [s]', 'step [rad/s]', 'acceleration',
                'limit', 'overspeed [m/s]', 'detected [s]', '<told', '<verdict']
    return {'passed': sum(1 for scenario in scenarios if scenario['result'] == 'passed'), 'scenarios': len(scenarios),
            'table': table(headings, [row_of(scenario) for scenario in scenarios])}
