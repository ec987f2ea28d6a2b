#!/usr/bin/python3
"""Drives the simulated Jackal with two controllers and plots both. Usage: first_drive.py [PICTURE.png]"""

import sys

import jackal_aic
import matplotlib
matplotlib.use('Agg')  # no window
import matplotlib.pyplot as plt  # noqa: E402

picture = sys.argv[1] if len(sys.argv) > 1 else 'first_drive.png'
slow_motors = {'plant.wheel_gain': 0.8}

for controller in ('diff_drive', 'predictive'):
    drive = jackal_aic.simulate('ground', controller, (0.5, 0.0), duration=3.0, overrides=slow_motors)
    print('{:11} {}'.format(controller, drive.response('speed')))
    plt.plot(drive.time, drive.speed, label=controller)

plt.plot(drive.time, drive.set_speed, 'k--', label='set point')
plt.xlabel('time [s]')
plt.ylabel('speed [m/s]')
plt.title('A robot whose wheels turn a fifth too slow')
plt.legend()
plt.savefig(picture)
print('Wrote', picture)
