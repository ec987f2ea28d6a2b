#include <fmt/format.h>

#include "bindings.hpp"
#include "jackal_aic/aic/active_inference.hpp"
#include "jackal_aic/aic/generalized_motion.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic::python {
namespace {

/// Channels in the order of channelsOf(), by the words of the fault injection.
struct ChannelWord {
  const char* word;
  bool ChannelValidity::*channel;
};
constexpr ChannelWord kChannels[] = {{"left", &ChannelValidity::wheel_left},
                                     {"right", &ChannelValidity::wheel_right},
                                     {"gyro", &ChannelValidity::yaw_rate},
                                     {"acceleration", &ChannelValidity::acceleration}};

ChannelValidity validityOf(const std::vector<std::string>& channels) {
  ChannelValidity valid{false, false, false, false};
  for (const std::string& name : channels) {
    bool known = false;
    for (const ChannelWord& channel : kChannels) {
      if (channel.word != name) continue;
      valid.*channel.channel = known = true;
    }
    if (!known) throw ParameterError("valid = '" + name + "': unknown; known: left, right, gyro, acceleration");
  }
  return valid;
}

void bindObservation(py::module& m) {
  py::class_<SetPoint>(m, "SetPoint", "Desired body velocity in base_link.")
      .def(py::init([](double forward, double yaw_rate) {
             return SetPoint{forward, 0.0, yaw_rate};
           }),
           py::arg("forward") = 0.0, py::arg("yaw_rate") = 0.0)
      .def_readwrite("forward", &SetPoint::forward, "x_dot [m/s]")
      .def_readwrite("yaw_rate", &SetPoint::yaw_rate, "theta_dot [rad/s], anticlockwise")
      .def("__repr__", [](const SetPoint& s) { return fmt::format("SetPoint({:g}, {:g})", s.forward, s.yaw_rate); });

  py::class_<Observation>(m, "Observation", "One synchronised reading of wheel encoders and IMU, in base_link.")
      .def(py::init([](double stamp, double wheel_left, double wheel_right, double yaw_rate, double acceleration_x,
                       double acceleration_y, std::optional<double> acceleration_z,
                       const std::vector<std::string>& valid) {
             return Observation{stamp,          yaw_rate,       wheel_left,     wheel_right,
                                acceleration_x, acceleration_y, acceleration_z, validityOf(valid)};
           }),
           py::arg("stamp"), py::arg("wheel_left"), py::arg("wheel_right"), py::arg("yaw_rate"),
           py::arg("acceleration_x") = 0.0, py::arg("acceleration_y") = 0.0, py::arg("acceleration_z") = py::none(),
           py::arg("valid") = py::make_tuple("left", "right", "gyro", "acceleration"),
           "valid: the channels that count. Raises ValueError for an unknown channel.")
      .def_readwrite("stamp", &Observation::stamp, "Time of the measurement [s].")
      .def_readwrite("wheel_left", &Observation::wheel_left,
                     "Mean speed of the left wheels [rad/s], positive is forward.")
      .def_readwrite("wheel_right", &Observation::wheel_right, "Mean speed of the right wheels [rad/s].")
      .def_readwrite("yaw_rate", &Observation::yaw_rate, "Gyro [rad/s], anticlockwise.")
      .def_readwrite("acceleration_x", &Observation::acceleration_x, "Accelerometer forward, without gravity [m/s^2].")
      .def_readwrite("acceleration_y", &Observation::acceleration_y,
                     "Accelerometer to the left, without gravity [m/s^2].")
      .def_readwrite("acceleration_z", &Observation::acceleration_z,
                     "Accelerometer upwards, with gravity [m/s^2], or None.")
      .def_readwrite("level", &Observation::level, "Whether gravity is removed from both by an attitude; False.")
      .def_property(
          "valid", [](const Observation& y) { return channelsOf(y.valid); },
          [](Observation& y, const std::vector<std::string>& channels) { y.valid = validityOf(channels); },
          "Channels that count, a tuple of 'left', 'right', 'gyro', 'acceleration'.")
      .def("__repr__", [](const Observation& y) {
        return fmt::format("<Observation at {:g} s: wheels {:g} and {:g} rad/s, yaw rate {:g} rad/s>", y.stamp,
                           y.wheel_left, y.wheel_right, y.yaw_rate);
      });
}

void bindModel(py::module& m) {
  py::class_<SkidSteerKinematics>(m, "Kinematics",
                                  "Skid-steer kinematics with an effective track and a slip factor (eq. 3-1).")
      .def(py::init([](double wheel_radius, double effective_track, double slip_factor) {
             GeometryParameters geometry;
             geometry.wheel_radius = wheel_radius;
             geometry.effective_track = effective_track;
             geometry.slip_factor = slip_factor;
             requireInRange(geometry, "robot");
             return SkidSteerKinematics(geometry);
           }),
           py::arg("wheel_radius") = GeometryParameters{}.wheel_radius,
           py::arg("effective_track") = GeometryParameters{}.effective_track,
           py::arg("slip_factor") = GeometryParameters{}.slip_factor,
           "wheel_radius r [m], effective_track b_hat [m], slip_factor alpha. Raises ValueError beyond their ranges.")
      .def(
          "body_velocity",
          [](const SkidSteerKinematics& k, double left, double right) {
            return k.bodyVelocity({left, right});
          },
          py::arg("left"), py::arg("right"),
          "Body velocity (x_dot, y_dot, theta_dot) [m/s, m/s, rad/s], shape (3,), of wheel speeds [rad/s].")
      .def(
          "wheel_speeds",
          [](const SkidSteerKinematics& k, double forward, double yaw_rate) {
            return pairOf(k.wheelSpeeds(forward, yaw_rate));
          },
          py::arg("forward"), py::arg("yaw_rate"),
          "Wheel speeds (left, right) [rad/s] of a forward speed [m/s] and a yaw rate [rad/s].")
      .def_property_readonly("forward_matrix", &SkidSteerKinematics::forwardMatrix,
                             "G, shape (3, 2): wheel speeds to body velocity (3-2).")
      .def_property_readonly("sensory_map", &SkidSteerKinematics::sensoryMap,
                             "R, shape (5, 3): body velocity to channels (3-3, 3-4).")
      .def_property_readonly("forward_model", &SkidSteerKinematics::forwardModel,
                             "K, shape (2, 5): d eps_y / d a (3-14).");

  using Sensed = Generalization<kSensorSize>;
  py::class_<Sensed>(m, "Generalization", "Generalised measurements y_tilde by the recursion of eq. 3-22.")
      .def(py::init([](int orders, double shortest_gap, double longest_gap) {
             if (orders < 0 || orders > kMaxOrders) {
               throw ParameterError(fmt::format("orders = {}: must be in [0, {}]", orders, kMaxOrders));
             }
             return Sensed(orders, shortest_gap, longest_gap);
           }),
           py::arg("orders") = 3, py::arg("shortest_gap") = 0.01, py::arg("longest_gap") = 0.5,
           R"(orders: highest generalised order p, 0 to 5.
shortest_gap: samples closer than this change y alone, not its derivatives [s].
longest_gap: after a longer gap the signal starts again [s].)")
      .def(
          "update", [](Sensed& g, const Observation& y) { return wordOf(g.update(y.stamp, y.vector())); },
          py::arg("observation"),
          "Takes a sample; 'accepted', 'restarted', or why it was refused: 'stale', 'not_finite', 'incomplete'.")
      .def("reset", &Sensed::reset, "Forgets all samples.")
      .def_property_readonly(
          "measurement", [](const Sensed& g) { return g.measurement(); },
          "y_tilde, shape (5, p+1): yaw rate, wheels left and right [rad/s], accelerations x and y [m/s^2]; column i "
          "is order i.");
}

/// A model of any size.
using AnyModel = LinearModel<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;

AnyModel anyModel(const Eigen::MatrixXd& sensory_map, const Eigen::MatrixXd& forward_model,
                  const Eigen::MatrixXd& state_precision, const Eigen::MatrixXd& sensory_precision, double tau,
                  int action_orders) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw ParameterError(what);
  };
  const Eigen::Index orders = state_precision.cols();
  require(orders >= 1 && orders <= kMaxOrders + 1, "state_precision: must have 1 to 6 columns, one for each order");
  require(
      sensory_map.cols() == state_precision.rows() && sensory_map.rows() == sensory_precision.rows(),
      "sensory_map: must have a row for each row of sensory_precision and a column for each row of state_precision");
  require(forward_model.cols() == sensory_map.rows(), "forward_model: must have a column for each row of sensory_map");
  require(sensory_precision.cols() == orders, "sensory_precision: must have as many columns as state_precision");
  require(action_orders >= 0 && action_orders < orders, "action_orders: must be one of the orders");
  require(tau > 0.0, "tau: must be above 0 s");
  return {tau, sensory_map, forward_model, state_precision, sensory_precision, action_orders};
}

void bindInference(py::module& m) {
  using Inference = ActiveInference<AnyModel>;
  py::class_<Inference>(m, "ActiveInference", "The thesis' belief and action (3-11, 3-13) over any linear model.")
      .def(py::init([](const Eigen::MatrixXd& sensory_map, const Eigen::MatrixXd& forward_model,
                       const Eigen::MatrixXd& state_precision, const Eigen::MatrixXd& sensory_precision, double tau,
                       double kappa_mu, double kappa_a, double belief_step, double action_step, bool euler,
                       int action_orders) {
             return Inference(
                 anyModel(sensory_map, forward_model, state_precision, sensory_precision, tau, action_orders),
                 {kappa_mu, kappa_a, belief_step, action_step, euler ? Integrator::euler : Integrator::exact});
           }),
           py::arg("sensory_map"), py::arg("forward_model"), py::arg("state_precision"), py::arg("sensory_precision"),
           py::arg("tau"), py::arg("kappa_mu"), py::arg("kappa_a"), py::arg("belief_step") = 0.001,
           py::arg("action_step") = 0.02, py::arg("euler") = false, py::arg("action_orders") = 0,
           R"(sensory_map: R, shape (sensors, states). forward_model: K, shape (actions, sensors).
state_precision, sensory_precision: 1/Sigma, shapes (states, p+1) and (sensors, p+1); 0: not measured.
tau: temporal parameter [s]. kappa_mu, kappa_a: learning rates of belief and action.
belief_step, action_step: time between their updates [s]. euler: forward Euler instead of the exact integrator.
action_orders: highest order whose sensory error drives the action.)")
      .def("set_set_point", &Inference::setSetPoint, py::arg("mu_d"), "Desired state, shape (states,).")
      .def("observe", &Inference::observe, py::arg("y_tilde"), "Generalised measurement, shape (sensors, p+1).")
      .def("restart_belief", &Inference::restartBelief, "Believes what the measurement says, with derivatives zero.")
      .def("update_belief", &Inference::updateBelief, "One step of the belief.")
      .def(
          "update_action", [](Inference& c) { return Eigen::VectorXd(c.updateAction()); },
          "One step of the action, shape (actions,).")
      .def_property_readonly(
          "belief", [](const Inference& c) { return Eigen::MatrixXd(c.belief()); }, "mu_tilde, shape (states, p+1).")
      .def_property_readonly(
          "action", [](const Inference& c) { return Eigen::VectorXd(c.action()); }, "a, shape (actions,).")
      .def_property_readonly(
          "free_energy", [](const Inference& c) { return freeEnergy(c.model(), c.errors()); }, "F now (3-10).");
}

/// The controller of a structure that parameters describe. @throws ParameterError if they describe another one.
template <class Controller>
std::unique_ptr<Controller> made(const Parameters& parameters, const char* name) {
  std::unique_ptr<VelocityController> made = makeController(parameters);
  auto* controller = dynamic_cast<Controller*>(made.get());
  if (controller == nullptr) {
    throw ParameterError("preset = " + parameters.preset + ": has no parameters of a " + name);
  }
  made.release();
  return std::unique_ptr<Controller>(controller);
}

constexpr const char* kOfParameters = "Raises ValueError if the parameters are those of another structure.";

}  // namespace

const char* wordOf(SampleVerdict verdict) {
  constexpr const char* kWords[] = {"accepted", "restarted", "stale", "not_finite", "incomplete"};
  return kWords[static_cast<int>(verdict)];
}

py::tuple channelsOf(const ChannelValidity& valid) {
  py::list names;
  for (const ChannelWord& channel : kChannels) {
    if (valid.*channel.channel) names.append(channel.word);
  }
  return py::tuple(names);
}

void bindControllers(py::module& m) {
  bindObservation(m);
  bindModel(m);
  bindInference(m);

  using Vector = Eigen::Matrix<double, kBodySize, 1>;
  py::class_<VelocityController>(m, "CoreController", R"(A controller of the core, called by hand.

The caller keeps the time: observe() when a measurement arrives, update_belief() every belief_step, and every
belief_steps_per_action of these update_action(), then hold() with what is really driven.)")
      .def(
          "set_set_point",
          [](VelocityController& c, double forward, double yaw_rate) {
            return c.setSetPoint({forward, 0.0, yaw_rate});
          },
          py::arg("forward"), py::arg("yaw_rate"), "Desired speed [m/s] and yaw rate [rad/s]; False if not finite.")
      .def(
          "observe", [](VelocityController& c, const Observation& y) { return wordOf(c.observe(y)); },
          py::arg("observation"), "Takes a measurement; the verdict is one of Generalization.update().")
      .def("update_belief", &VelocityController::updateBelief, "One step of the belief.")
      .def(
          "update_action", [](VelocityController& c) { return pairOf(c.updateAction()); },
          "One step of the action: wheel speeds (left, right) [rad/s]; zero before the first measurement.")
      .def(
          "hold",
          [](VelocityController& c, double left, double right) {
            c.hold({left, right});
          },
          py::arg("left"), py::arg("right"), "Tells which part of the action is really driven [rad/s].")
      .def("reset", &VelocityController::reset, "Forgets everything except the parameters.")
      .def_property_readonly(
          "believed_velocity", [](const VelocityController& c) -> Vector { return c.believedVelocity(); },
          "Believed (x_dot, y_dot, theta_dot) [m/s, m/s, rad/s], shape (3,); zero without a belief.")
      .def_property_readonly(
          "action", [](const VelocityController& c) { return pairOf(c.action()); },
          "Wheel speeds (left, right) [rad/s].")
      .def_property_readonly("free_energy", &VelocityController::freeEnergy, "F now.")
      .def_property_readonly("belief_step", &VelocityController::beliefStep, "Time between belief updates [s].")
      .def_property_readonly("belief_steps_per_action", &VelocityController::beliefStepsPerAction,
                             "Belief updates per action update.");

  py::class_<ActiveInferenceController, VelocityController>(
      m, "ActiveInferenceController", "The thesis' controller: presets standard, improved, tuned.")
      .def(py::init([](const Parameters& p) { return made<ActiveInferenceController>(p, "thesis controller"); }),
           py::arg("parameters"), kOfParameters)
      .def_property_readonly(
          "belief", [](const ActiveInferenceController& c) { return c.belief(); },
          "mu_tilde, shape (3, p+1); column i is order i.")
      .def_property_readonly(
          "measurement", [](const ActiveInferenceController& c) { return c.measurement(); },
          "y_tilde, shape (5, p+1); see Generalization.measurement.");

  py::class_<PredictiveController, VelocityController>(
      m, "PredictiveController", "The controller that predicts with a model of the drive train: preset predictive.")
      .def(py::init([](const Parameters& p) { return made<PredictiveController>(p, "predictive controller"); }),
           py::arg("parameters"), kOfParameters)
      .def_property_readonly("effective_track", &PredictiveController::effectiveTrack,
                             "Believed b_hat, turning in place [m].");

  py::class_<DifferentialDrive, VelocityController>(m, "DifferentialDrive",
                                                    "The open-loop baseline: preset diff_drive.")
      .def(py::init([](const Parameters& p) { return made<DifferentialDrive>(p, "differential drive"); }),
           py::arg("parameters"), kOfParameters);
}

}  // namespace jackal_aic::python
