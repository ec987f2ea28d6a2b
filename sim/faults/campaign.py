"""The node between the simulated robot and the controller: leads both through scenarios, and records.

From the plant it takes robot/clock, robot/joint_states, robot/imu/data and robot/feedback, and hands them on without "robot/", with
the faults of a scenario; from the controller it takes cmd_drive and hands it on as robot/cmd_drive. It also is the operator
(jackal_AIC/set_point, e_stop) and the robot's firmware (status). Time is that of robot/clock, so that faults come at the same
simulated time in every run.
"""

import functools
import math
import os
import signal
import threading
import time as wall
import xmlrpc.client

import rosgraph
import rospy
from geometry_msgs.msg import Twist, Vector3, Wrench
from jackal_aic.msg import ControllerState
from jackal_msgs.msg import Drive, Feedback, Status
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Time
from std_srvs.srv import Empty, SetBool

import channel
import judge

CONTROLLER, PLANT = '/jackal_aic', '/plant'
OF_ROBOT = {'joint_states': ('joint_states', JointState), 'imu': ('imu/data', Imu), 'feedback': ('feedback', Feedback)}
TO_CONTROLLER = dict(OF_ROBOT, status=('status', Status), set_point=('jackal_AIC/set_point', Twist))
SEEN = 0.01  # s between words to the plant of how far this node has come
AHEAD = 0.1  # s by which other messages may come before that of the clock; the plant waits for this node after 0.022 s
# s between set points, as an operator's joystick sends them, statuses, as the firmware, and commands of a second publisher
PERIODS = {'set_point': 0.05, 'status': 1.0, 'intrusion': 0.02}
FIRST_SET_POINT = 0.3  # s after the start of a run; zero until then, which releases a latch
REST = 3.0  # s at rest before a run, in which the controller learns the noise of its sensors
SILENCE = 0.3  # s without a command, after which the next is a new process'
LAST_WORD = 0.2  # s before the end, within which the controller has to have spoken
LATEST_SUCCESSOR = 60.0  # s after the end, until a controller that was ended has to be there again
PATIENCE = 30.0  # s on the wall clock without any progress
SIGNALS = {'kill': signal.SIGKILL, 'interrupt': signal.SIGINT, 'terminate': signal.SIGTERM}
WORDS = {getattr(ControllerState, word.upper()): word for word in ('idle', 'driving', 'stopped', 'braking', 'faulted')}


def process_of(node):
    """Process id of a node that runs on this machine, asked of the node itself; 0 if it is not there."""
    try:
        uri = rosgraph.Master(rospy.get_name()).lookupNode(node)
        return xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())[2]
    except (rosgraph.MasterException, OSError):
        return 0


def is_running(process):
    """Whether a process exists and has not ended; one that was not waited for is a zombie."""
    try:
        with open('/proc/{}/stat'.format(process)) as file:
            return file.read().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


class Campaign:

    def __init__(self):
        self._lock = threading.RLock()
        self._channels = {topic: channel.Channel(topic) for topic in (*TO_CONTROLLER, 'cmd_drive')}
        self._time, self._base, self._offset = 0.0, 0.0, 0.0  # s of the run; at the last reset of the plant's clock; of all stamps
        self._plant_clock, self._seen, self._ticks, self._resets = 0.0, 0.0, 0, 0
        self._recording, self._record, self._states = False, judge.Record(), []  # states: since the last reset
        self._end_requested = self._world_is_new = self._succeeded = False
        self._set_point, self._intruder, self._tasks, self._next, self._process = (0.0, 0.0), None, [], {}, 0
        self._plant_before = {}  # parameters that a scenario changed; None: not given
        publish = functools.partial(rospy.Publisher, queue_size=1000, tcp_nodelay=True)
        self._publishers = {topic: publish(name, message) for topic, (name, message) in TO_CONTROLLER.items()}
        self._publishers['cmd_drive'] = publish('robot/cmd_drive', Drive)
        self._clock, self._told = publish('/clock', Clock), publish(PLANT + '/seen', Time)
        self._e_stop, self._push = rospy.Publisher('e_stop', Bool, queue_size=1, latch=True), publish(PLANT + '/push', Wrench)
        for topic, (name, message) in OF_ROBOT.items():
            self._subscribe('robot/' + name, message, functools.partial(self._relay, topic))
        for name, message, take in (('robot/clock', Clock, self._on_clock), ('cmd_drive', Drive, self._on_command),
                                    ('ground_truth/odom', Odometry, self._on_truth), ('jackal_AIC/state', ControllerState, self._on_state)):
            self._subscribe(name, message, take)

    def _subscribe(self, name, message, take):

        def locked(received):
            with self._lock:
                take(received)

        rospy.Subscriber(name, message, locked, tcp_nodelay=True)

    # ---- messages

    def _send(self, topic, message=None):
        """Takes a message of a topic, if there is one, and sends what is due."""
        if message is not None:
            self._channels[topic].take(self._time, message)
        for due in self._channels[topic].due(self._time):
            self._publishers[topic].publish(due)

    def _relay(self, topic, message):
        if self._offset:
            message.header.stamp = rospy.Time.from_sec(max(0.0, message.header.stamp.to_sec() + self._offset))
        self._send(topic, message)

    def _on_clock(self, message):
        now = message.clock.to_sec()
        self._ticks += 1
        if now < self._plant_clock:
            self._base, self._seen, self._resets = self._time, 0.0, self._resets + 1
        self._plant_clock, self._time = now, self._base + now
        self._clock.publish(Clock(rospy.Time.from_sec(max(0.0, now + self._offset)) if self._offset else message.clock))
        for topic in self._channels:
            self._send(topic)
        if now - self._seen >= SEEN - 1e-9:
            self._seen = now
            self._told.publish(Time(message.clock))
        if self._recording:
            while self._tasks and self._tasks[0][0] <= self._time:
                self._tasks.pop(0)[1]()
            self._send_periodically()

    def _send_periodically(self):
        due = [name for name, period in PERIODS.items() if self._time >= self._next[name]]
        self._next.update({name: self._next[name] + PERIODS[name] for name in due})
        if 'set_point' in due:
            forward, yaw_rate = (0.0, 0.0) if self._time < FIRST_SET_POINT else self._set_point
            self._send('set_point', Twist(linear=Vector3(x=forward), angular=Vector3(z=yaw_rate)))
        if 'status' in due:
            status = Status(drivers_active=True, driver_external_stop_present=True)
            status.header.stamp = rospy.Time.from_sec(max(0.0, self._time - self._base + self._offset))
            self._send('status', status)
        if 'intrusion' in due and self._intruder is not None:
            publisher, speed = self._intruder
            publisher.publish(Drive(mode=Drive.MODE_VELOCITY, drivers=[speed, speed]))

    def _on_command(self, drive):
        self._send('cmd_drive', drive)
        if not self._recording or drive._connection_header['callerid'] != CONTROLLER:
            return
        commands, fresh = self._record.commands, False
        if self._end_requested and commands and self._time - commands[-1].time > SILENCE:
            fresh, self._end_requested, self._succeeded = True, False, True
        if self._world_is_new and not any(drive.drivers):  # those under way at a new start of the world do not count yet
            fresh, self._world_is_new = True, False
        commands.append(judge.Command(self._time, *drive.drivers, fresh))

    def _on_truth(self, odometry):
        stamp = odometry.header.stamp.to_sec()
        if self._recording and stamp <= self._plant_clock + AHEAD:  # else of before a reset
            twist = odometry.twist.twist
            self._record.truth.append(judge.Truth(self._base + stamp, twist.linear.x, twist.angular.z))

    def _on_state(self, state):
        self._states.append(state)
        if self._recording:
            text = WORDS.get(state.status, '?') + (': ' + state.reason if state.reason else '')
            self._record.states.append(judge.State(self._time, state.status == ControllerState.DRIVING, text, state.rejected_set_points,
                                                   state.rejected_measurements))

    # ---- faults of robot, clock and process

    def _plan(self, fault, onset):
        begin, end = {
            'e_stop': (lambda: self._e_stop.publish(True), lambda: self._e_stop.publish(False)),
            'second_publisher': (lambda: self._intrude(fault.amount), self._leave),
            'push': (lambda: self._push_robot(fault.amount, fault.torque), lambda: self._push_robot(0.0, 0.0)),
            'clock_jump': (lambda: self._shift_clock(fault.amount), None), 'clock_reset': (self._start_world_anew, None),
            'pause': (lambda: self._pause_plant(fault.duration), None),
            'stall': (lambda: os.kill(self._process, signal.SIGSTOP), lambda: os.kill(self._process, signal.SIGCONT)),
            'master_restart': (lambda: os.kill(rosgraph.Master(rospy.get_name()).getPid(), signal.SIGKILL), None)
        }.get(fault.kind, (None, None))
        if fault.kind in ('block_left', 'block_right', 'lift'):
            begin, end = (functools.partial(self._call, fault.kind, SetBool, on) for on in (True, False))
        if fault.kind in SIGNALS:
            begin = functools.partial(self._end_controller, SIGNALS[fault.kind])
        self._tasks += [(onset + fault.start, begin)] + ([(onset + fault.start + fault.duration, end)] if end else [])

    def _call(self, service, kind, *arguments):
        """Calls a service of the plant, which may be called twice, until it answers."""
        for _ in range(5):
            try:
                rospy.wait_for_service(PLANT + '/' + service, PATIENCE)
                return rospy.ServiceProxy(PLANT + '/' + service, kind)(*arguments)
            except rospy.ServiceException:
                continue
            except rospy.ROSException:
                break
        self._break_down('the plant has no service ' + service)

    def _intrude(self, speed):
        self._intruder = rospy.Publisher('cmd_drive', Drive, queue_size=1), speed
        self._next['intrusion'] = self._time

    def _leave(self):
        if self._intruder is not None:
            self._intruder[0].unregister()
        self._intruder = None

    def _push_robot(self, force, torque):
        self._push.publish(Wrench(force=Vector3(x=force), torque=Vector3(z=torque)))

    def _shift_clock(self, seconds):
        self._offset += seconds

    def _start_world_anew(self):
        self._call('reset', Empty)
        self._world_is_new = True

    def _end_controller(self, number):
        self._end_requested = True
        os.kill(self._process, number)

    def _pause_plant(self, seconds):
        plant = process_of(PLANT)
        os.kill(plant, signal.SIGSTOP)
        threading.Timer(seconds, os.kill, (plant, signal.SIGCONT)).start()

    def _break_down(self, reason):
        self._record.breakdown = self._record.breakdown or reason

    # ---- runs

    def run(self, scenario):
        """Puts robot and clock back to the start, runs a scenario and returns what happened, as a judge.Record."""
        self._record, self._tasks = judge.Record(), []
        self._end_requested = self._world_is_new = self._succeeded = False
        if not self._restart(scenario):
            self._break_down('the nodes do not start: no state of the controller after a reset')
            return self._record
        self._process = process_of(CONTROLLER)
        with self._lock:
            self._arm(scenario)
            self._recording = True
        # A controller that was ended here is there again, and has heard everybody, once a busy machine has started it.
        completed = self._wait(lambda: self._time >= scenario.end() + LATEST_SUCCESSOR or (
            self._time >= scenario.end() and not self._end_requested and not (self._succeeded and self._starting())))
        with self._lock:
            self._recording = False
            for _, action in self._tasks:  # so that no process stays stopped
                action()
            self._leave()
            if not completed:
                self._break_down('the simulation stands still')
            if not self._succeeded and not is_running(self._process):
                self._break_down('the controller crashed')
            elif self._silent():
                self._break_down('the controller fell silent')
        return self._record

    def _starting(self):
        return self._silent() or 'not checked yet' in self._record.states[-1].text

    def _silent(self):
        return not self._record.states or self._record.states[-1].time < self._time - LAST_WORD

    def _arm(self, scenario):
        for topic, one in self._channels.items():
            one.arm(scenario.of(topic) if scenario else (), scenario.onset if scenario else 0.0)
        self._next = dict.fromkeys(PERIODS, 0.0)
        self._set_point = scenario.set_point if scenario else (0.0, 0.0)
        for fault in scenario.of('system') if scenario else ():
            self._plan(fault, scenario.onset)
        self._tasks.sort(key=lambda task: task[0])

    def _restart(self, scenario):
        with self._lock:
            self._arm(None)
            self._offset = self._base = 0.0
            self._e_stop.publish(False)
            self._states = []
        # A controller that was killed in the run before has to be there again, to hear and measure, and to have no fault any more,
        # before the clock is put back for all: from then on the time of the run counts.
        if not self._wait(lambda: self._states and self._connected() and self._stands()):
            return False
        rested, resets = self._time + REST, self._resets
        if not self._wait(lambda: self._time >= rested):
            return False
        self._change_plant(scenario)
        with self._lock:
            self._call('reset', Empty)
        if not self._wait(lambda: self._resets != resets):
            return False
        with self._lock:
            self._base, self._time, self._states = 0.0, self._plant_clock, []
        return self._wait(lambda: self._states and self._stands())

    def _connected(self):
        heard = all(self._publishers[topic].get_num_connections() > 0 for topic in TO_CONTROLLER)
        return heard and math.isfinite(self._states[-1].measured_forward) and math.isfinite(self._states[-1].measured_yaw_rate)

    def _stands(self):
        return self._states[-1].status in (ControllerState.IDLE, ControllerState.STOPPED)

    def _change_plant(self, scenario):
        """Sets the plant's parameters of a scenario, and back what the one before had set; the next reset uses them."""
        for key, value in self._plant_before.items():
            rospy.delete_param(key) if value is None else rospy.set_param(key, value)
        self._plant_before = {}
        for name, value in scenario.plant.items():
            key = '{0}{0}/{1}'.format(PLANT, name)
            self._plant_before[key] = rospy.get_param(key, None)
            rospy.set_param(key, value)

    def _wait(self, condition):
        """Until a condition holds; False if the simulation or, before a run, the condition takes too long."""
        began, ticks, progress = wall.monotonic(), self._ticks, wall.monotonic()
        while not rospy.is_shutdown():
            with self._lock:
                if condition():
                    return True
                if self._ticks != ticks:
                    ticks, progress = self._ticks, wall.monotonic()
            if wall.monotonic() - progress > PATIENCE or (not self._recording and wall.monotonic() - began > PATIENCE):
                return False
            wall.sleep(0.005)
        return False
