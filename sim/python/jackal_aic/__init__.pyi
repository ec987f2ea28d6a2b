"""Types for editors; the docstrings of the module say what everything means (help(jackal_aic.simulate))."""

import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy

CAUSES: Tuple[str, ...]
FAULTS: Tuple[str, ...]
STATUSES: Tuple[str, ...]

_Wheels = Tuple[float, float]
_Overrides = Mapping[str, Any]

class SetPoint:
    forward: float
    yaw_rate: float
    def __init__(self, forward: float = ..., yaw_rate: float = ...) -> None: ...

class Observation:
    stamp: float
    wheel_left: float
    wheel_right: float
    yaw_rate: float
    acceleration_x: float
    acceleration_y: float
    acceleration_z: Optional[float]
    valid: Tuple[str, ...]
    def __init__(self, stamp: float, wheel_left: float, wheel_right: float, yaw_rate: float, acceleration_x: float = ...,
                 acceleration_y: float = ..., acceleration_z: Optional[float] = ..., valid: Sequence[str] = ...) -> None: ...

class Parameters:
    structure: str
    def __init__(self, preset: str = ..., plant_model: str = ..., robot: str = ..., overrides: _Overrides = ...) -> None: ...
    def __getitem__(self, key: str) -> Any: ...
    def replaced(self, overrides: _Overrides) -> Parameters: ...
    def values(self) -> Dict[str, Any]: ...
    def yaml(self) -> str: ...

class Kinematics:
    forward_matrix: numpy.ndarray
    sensory_map: numpy.ndarray
    forward_model: numpy.ndarray
    def __init__(self, wheel_radius: float = ..., effective_track: float = ..., slip_factor: float = ...) -> None: ...
    def body_velocity(self, left: float, right: float) -> numpy.ndarray: ...
    def wheel_speeds(self, forward: float, yaw_rate: float) -> _Wheels: ...

class Generalization:
    measurement: numpy.ndarray
    def __init__(self, orders: int = ..., shortest_gap: float = ..., longest_gap: float = ...) -> None: ...
    def update(self, observation: Observation) -> str: ...
    def reset(self) -> None: ...

class ActiveInference:
    belief: numpy.ndarray
    action: numpy.ndarray
    free_energy: float
    def __init__(self, sensory_map: numpy.ndarray, forward_model: numpy.ndarray, state_precision: numpy.ndarray,
                 sensory_precision: numpy.ndarray, tau: float, kappa_mu: float, kappa_a: float, belief_step: float = ...,
                 action_step: float = ..., euler: bool = ..., action_orders: int = ...) -> None: ...
    def set_set_point(self, mu_d: numpy.ndarray) -> None: ...
    def observe(self, y_tilde: numpy.ndarray) -> None: ...
    def restart_belief(self) -> None: ...
    def update_belief(self) -> None: ...
    def update_action(self) -> numpy.ndarray: ...
    def hold(self, applied: numpy.ndarray) -> None: ...

class CoreController:
    believed_velocity: numpy.ndarray
    action: _Wheels
    free_energy: float
    belief_step: float
    belief_steps_per_action: int
    def set_set_point(self, forward: float, yaw_rate: float) -> bool: ...
    def observe(self, observation: Observation) -> str: ...
    def update_belief(self) -> None: ...
    def update_action(self) -> _Wheels: ...
    def hold(self, left: float, right: float) -> None: ...
    def overrule(self, left: float, right: float) -> None: ...
    def restart(self) -> None: ...
    def reset(self) -> None: ...

class ActiveInferenceController(CoreController):
    belief: numpy.ndarray
    measurement: numpy.ndarray
    def __init__(self, parameters: Parameters) -> None: ...

class PredictiveController(CoreController):
    motion_covariance: numpy.ndarray
    effective_track: float
    plant_model: Dict[str, Any]
    def __init__(self, parameters: Parameters) -> None: ...
    def freeze_learning(self, frozen: bool) -> None: ...

class DifferentialDrive(CoreController):
    def __init__(self, parameters: Parameters) -> None: ...

class VelocityController:
    rate: float
    applied: _Wheels
    believed: Optional[Tuple[float, float]]
    def reset(self) -> None: ...
    def act(self, set_point: SetPoint, observation: Observation) -> Sequence[float]: ...

class DriveLoop:
    status: str
    cause: str
    fault: str
    reason: str
    counts: Dict[str, int]
    command: _Wheels
    set_point: SetPoint
    counted: Tuple[str, ...]
    believed_velocity: numpy.ndarray
    def __init__(self, parameters: Parameters, controller: Optional[VelocityController] = ...) -> None: ...
    def set_set_point(self, forward: float, yaw_rate: float, now: float) -> str: ...
    def observe(self, observation: Observation, now: float) -> bool: ...
    def advance(self, now: float) -> Optional[_Wheels]: ...
    def release(self) -> None: ...
    def report(self, now: float, emergency_stop: bool = ..., robot_stopped: bool = ..., motors_off: bool = ...,
               driver_fault: bool = ...) -> None: ...

class Margins:
    gain_margin: float
    gain_reduction: float
    delay_margin: float
    delay_reduction: float

class ModeCertificate(Margins):
    spectral_radius: float
    radius_uncertainty: float

class Certificate(Margins):
    stable: bool
    belief_spectral_radius: float
    loop_spectral_radius: float
    period: float
    straight: ModeCertificate
    turn: ModeCertificate
    advice: str

def certify(parameters: Parameters, robot: _Overrides = ...) -> Certificate: ...

class LinearLoop:
    period: float
    longest_phase: float
    robot: Dict[str, Any]
    def spectral_radius(self, gain: float = ..., extra_dead_time: float = ..., phase: float = ...) -> float: ...
    def step_response(self, periods: int, phase: float = ...) -> numpy.ndarray: ...
    def certify(self) -> Certificate: ...

def linear_loops(robot: str, controller: str, overrides: _Overrides = ...) -> List[LinearLoop]: ...

class Estimate:
    value: float
    half_width: float
    unknown: str

class Identification:
    dead_time: Estimate
    lag: Estimate
    gain: Estimate
    offset: Estimate
    acceleration_limit: Estimate
    track_left: Estimate
    track_right: Estimate
    residual: float
    r_squared: float
    remarks: List[str]

def identify(commands: numpy.ndarray, wheels: numpy.ndarray, yaw_rate: Optional[numpy.ndarray] = ..., wheel_radius: float = ...,
             slip_factor: float = ...) -> Identification: ...

class Odometry:
    pose: Tuple[float, float, float]
    pose_covariance: numpy.ndarray
    motion: Tuple[float, float]
    motion_covariance: numpy.ndarray
    def __init__(self, parameters: Parameters) -> None: ...
    def observe(self, observation: Observation) -> None: ...
    def advance(self, left: float, right: float, duration: float) -> None: ...

class FaultReport:
    fault: str
    faulty: bool
    valid: Tuple[str, ...]
    distances: Dict[str, float]
    stuck: bool
    moved: bool

class FaultMonitor:
    def __init__(self, parameters: Parameters) -> None: ...
    def advance(self, applied: Optional[_Wheels], duration: float) -> None: ...
    def check(self, observation: Observation) -> FaultReport: ...
    def reset(self) -> None: ...

class StepResponse:
    settling_time: Optional[float]
    rise_time: Optional[float]
    overshoot: float
    steady_error: float
    bounded: bool

def step_response(time: Sequence[float], value: Sequence[float], step_time: float, initial: float, set_point: float,
                  settling_band: float = ...) -> StepResponse: ...

class Fault(NamedTuple):
    kind: str
    start: float = ...
    channel: str = ...
    value: float = ...
    duration: float = ...

class Drive:
    time: numpy.ndarray
    set_speed: numpy.ndarray
    set_yaw_rate: numpy.ndarray
    speed: numpy.ndarray
    yaw_rate: numpy.ndarray
    x: numpy.ndarray
    y: numpy.ndarray
    heading: numpy.ndarray
    wheel_left: numpy.ndarray
    wheel_right: numpy.ndarray
    measured_speed: numpy.ndarray
    measured_yaw_rate: numpy.ndarray
    measured_left: numpy.ndarray
    measured_right: numpy.ndarray
    believed_speed: numpy.ndarray
    believed_yaw_rate: numpy.ndarray
    command_left: numpy.ndarray
    command_right: numpy.ndarray
    status: numpy.ndarray
    cause: numpy.ndarray
    fault: numpy.ndarray
    counted: numpy.ndarray
    events: List[Tuple[float, str]]
    findings: List[Tuple[float, str, bool]]
    set_points: List[Tuple[float, float, float]]
    effective_track: Optional[float]
    def columns(self) -> Dict[str, numpy.ndarray]: ...
    def response(self, channel: str = ...) -> StepResponse: ...
    def settling_time(self, channel: str = ...) -> Optional[float]: ...

_Fault = Union[Fault, Mapping[str, Any]]

def simulate(robot: Union[str, os.PathLike], controller: Union[str, os.PathLike, Parameters, VelocityController],
             set_points: Union[Tuple[float, float], Sequence[Tuple[float, float, float]]], *, duration: float = ...,
             faults: Union[_Fault, Sequence[_Fault]] = ..., seed: Optional[int] = ..., overrides: Optional[_Overrides] = ...,
             monitor: Union[bool, _Overrides, None] = ..., as_printed: bool = ..., samples_only: bool = ...,
             odometry: bool = ...) -> Drive: ...

def settings(robot: str, controller: str, overrides: _Overrides = ..., as_printed: bool = ...) -> Dict[str, Any]: ...

def state_space_response(controller: str, set_point: float, duration: float,
                         overrides: _Overrides = ...) -> Tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]: ...

def replay_recording(samples: numpy.ndarray, wheel_radius: float, wheel_distance: float, plant_model: _Overrides, has_imu: bool,
                     motions: numpy.ndarray) -> Dict[str, Any]: ...

def linear_figures(plant: str, controller: Union[VelocityController, _Overrides],
                   dead_time_factor: float = ...) -> Dict[str, Any]: ...
