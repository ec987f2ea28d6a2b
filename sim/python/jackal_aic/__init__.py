"""Active inference control of a Clearpath Jackal: controllers, drive loop and simulated robot.

    drive = jackal_aic.simulate('ground', 'predictive', (0.5, 0.0), duration=3.0)
    print(drive.settling_time())

The compiled part is loaded when a name of it is first used: jackal_aic.msg, which other nodes import, does without it.
"""

_OF_CORE = ('ActiveInference', 'ActiveInferenceController', 'CAUSES', 'Certificate', 'CoreController', 'DifferentialDrive', 'DriveLoop', 'Estimate',
            'FAULTS', 'FaultMonitor', 'FaultReport', 'Generalization', 'Identification', 'Kinematics', 'LinearLoop',
            'Observation', 'Odometry', 'Parameters', 'PredictiveController', 'STATUSES', 'SetPoint', 'certify',
            'identify', 'linear_loops', 'settings')
_OF_SIMULATION = ('Drive', 'Fault', 'StepResponse', 'VelocityController', 'simulate', 'step_response')

__all__ = sorted(_OF_CORE + _OF_SIMULATION)


def __getattr__(name):
    if name not in __all__:
        raise AttributeError("module 'jackal_aic' has no attribute '{}'".format(name))
    from importlib import import_module
    value = getattr(import_module('jackal_aic._core' if name in _OF_CORE else 'jackal_aic._simulation'), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted(set(globals()) | set(__all__))
