#!/usr/bin/python3
"""A PI controller for each wheel, compared with the predictive controller."""

import jackal_aic


class PI(jackal_aic.VelocityController):
    """Feedforward by the kinematics, and the integral of each wheel's error."""

    gain = 1.0  # 1/s

    def reset(self):
        self.kinematics = jackal_aic.Kinematics()
        self.integral = [0.0, 0.0]  # rad/s

    def act(self, set_point, observation):
        wanted = self.kinematics.wheel_speeds(set_point.forward, set_point.yaw_rate)
        measured = (observation.wheel_left, observation.wheel_right)
        command = []
        for side in (0, 1):
            self.integral[side] += self.gain / self.rate * (wanted[side] - measured[side])
            command.append(wanted[side] + self.integral[side])
        return command


for name, controller in (('PI', PI()), ('predictive', 'predictive')):
    for gain in (1.0, 0.8):
        drive = jackal_aic.simulate('ground', controller, (0.5, 0.0), duration=4.0, overrides={'plant.wheel_gain': gain})
        print('{:10} motors of gain {}: {}'.format(name, gain, drive.response('speed')))
