"""Node faults: runs the fault campaign and writes a row per scenario. Ends with status 0 if all passed, 2 if one failed."""

import csv

import rospy

import campaign
import judge
import scenarios

def run_all(nodes, chosen, limits, file):
    """Each scenario once; True if all passed."""
    table, passed = csv.DictWriter(file, judge.COLUMNS, lineterminator='\n'), True
    table.writeheader()
    for scenario in chosen:
        if rospy.is_shutdown():
            break
        row = judge.Verdict(scenario, nodes.run(scenario), limits).row()
        table.writerow(row)
        file.flush()
        passed = passed and row['result'] == 'passed'
    return passed


def run():
    given = rospy.get_param('~', {})
    chosen = scenarios.selected(given['scenarios'], given['select'], given['own_launch'], real=given['real'])
    limits = judge.limits_of(given['plant'])
    nodes = campaign.Campaign()
    with open(given['results'] or '/dev/stdout', 'w') as file:
        return 0 if run_all(nodes, chosen, limits, file) else 2


def main():
    rospy.init_node('faults')
    try:
        return run()
    except (OSError, ValueError) as error:
        rospy.logfatal(' '.join(str(error).split()))
        return 1
