#!/usr/bin/python3
"""The core of the fault campaign, or its part on the plant real (argument "real"): scenarios through the real nodes, each judged as
./scripts/faults does."""

import pathlib
import sys
import unittest

import rospkg
import rospy
import rostest

SOURCE = pathlib.Path(rospkg.RosPack().get_path('jackal_aic'))
sys.path.insert(0, str(SOURCE / 'sim/faults'))

import campaign  # noqa: E402
import judge  # noqa: E402
import scenarios  # noqa: E402

REAL = 'real' in sys.argv


class Faults(unittest.TestCase):
    """One node for all tests: the scenarios of a campaign follow each other on one ROS graph."""

    @classmethod
    def setUpClass(cls):
        cls.nodes = campaign.Campaign()
        cls.limits = judge.limits_of(str(SOURCE / 'config' / ('plant_real.yaml' if REAL else 'plant.yaml')))


def add_test(scenario):

    def test(self):
        verdict = judge.Verdict(scenario, self.nodes.run(scenario), self.limits)
        self.assertEqual(verdict.failures, [], verdict.row()['history'])

    setattr(Faults, 'test_' + scenario.name.replace('/', '_'), test)


for chosen in scenarios.selected(str(SOURCE / 'sim/faults/scenarios.yaml'), core=not REAL, real=REAL):
    if not (REAL and chosen.core):  # on the ground these are driven as well
        add_test(chosen)

if __name__ == '__main__':
    rospy.init_node('faults_test')
    rostest.rosrun('jackal_aic', 'faults', Faults)
