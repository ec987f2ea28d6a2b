"""Node faults: runs the fault campaign and writes a row per scenario. Ends with status 0 if all passed, 2 if one failed."""

import csv
import random

import rospy

import campaign
import judge
import scenarios

LARGEST_GROWTH = 1.0  # MiB of the controller's memory in a soak


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


def soak(nodes, chosen, limits, duration, file):
    """Scenarios picked at random (seeded) for a simulated time [s], except those that end the controller's process, whose memory is
    watched: true if no run was unsound, and the memory grew by less than LARGEST_GROWTH after the first tenth of the time."""
    chosen = [scenario for scenario in chosen if not any(fault.kind in scenarios.ENDING for fault in scenario.of('system'))]
    table, draw, runs, unsound, memory = csv.writer(file, lineterminator='\n'), random.Random(1), 0, 0, []
    table.writerow(('simulated_s', 'scenario', 'resident_MiB', 'result'))
    while not rospy.is_shutdown() and nodes.simulated < duration:
        scenario = draw.choice(chosen)
        found = judge.Verdict(scenario, nodes.run(scenario), limits).unsound
        resident = campaign.resident_memory(nodes.controller_process())
        found += [] if resident else ['the controller does not run']
        memory.append((nodes.simulated, resident))
        runs, unsound = runs + 1, unsound + bool(found)
        table.writerow(('{:.1f}'.format(nodes.simulated), scenario.name, '{:.3f}'.format(resident),
                        'unsound: ' + '; '.join(found) if found else 'sound'))
        file.flush()
    growth = judge.memory_growth(memory, 0.1 * duration)
    passed = unsound == 0 and growth < LARGEST_GROWTH
    file.write('# {}: {} of {} runs unsound, memory grown by {:.3f} MiB after the warm-up, allowed {:g}\n'.format(
        'passed' if passed else 'failed', unsound, runs, growth, LARGEST_GROWTH))
    return passed


def run():
    given = rospy.get_param('~', {})
    chosen = scenarios.selected(given['scenarios'], given['select'], given['own_launch'], real=given['real'])
    limits = judge.limits_of(given['plant'])
    nodes = campaign.Campaign()
    with open(given['results'] or '/dev/stdout', 'w') as file:
        if given['soak'] > 0.0:
            return 0 if soak(nodes, chosen, limits, given['soak'], file) else 2
        return 0 if run_all(nodes, chosen, limits, file) else 2


def main():
    rospy.init_node('faults')
    try:
        return run()
    except (OSError, ValueError) as error:
        rospy.logfatal(' '.join(str(error).split()))
        return 1
