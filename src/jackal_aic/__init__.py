"""Active inference control of a Clearpath Jackal: controllers, drive loop and simulated robot.

    drive = jackal_aic.simulate('ground', 'predictive', (0.5, 0.0), duration=3.0)
    print(drive.settling_time())

Its modules are loaded when a name of them is first used: jackal_aic.msg, which other nodes import, does without them, and
jackal_aic.identify without the compiled part, which a robot's build (-DJACKAL_AIC_SIMULATION=OFF) does not have.
"""

_MODULES = {
    '_core': ('ActiveInference', 'ActiveInferenceController', 'CAUSES', 'Certificate', 'CoreController', 'DifferentialDrive', 'DriveLoop',
              'FAULTS', 'FaultMonitor', 'FaultReport', 'Generalization', 'Kinematics', 'LinearLoop', 'Observation', 'Odometry', 'Parameters',
              'PredictiveController', 'STATUSES', 'SetPoint', 'certify', 'linear_loops', 'settings'),
    '_simulation': ('Drive', 'Fault', 'StepResponse', 'VelocityController', 'simulate', 'step_response'),
    'identification': ('Estimate', 'Identification', 'identify')}

__all__ = sorted(name for names in _MODULES.values() for name in names)


def __getattr__(name):
    from importlib import import_module
    for module, names in _MODULES.items():
        if name in names:
            globals()[name] = getattr(import_module('jackal_aic.' + module), name)
            return globals()[name]
    raise AttributeError("module 'jackal_aic' has no attribute '{}'".format(name))


def __dir__():
    return sorted(set(globals()) | set(__all__))
