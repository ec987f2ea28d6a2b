#include "baselines.hpp"

#include <algorithm>
#include <iterator>

#include "model_predictive.hpp"
#include "regulators.hpp"
#include "wheelwise_controller.hpp"

namespace jackal_aic::sim {
namespace {

using Values = std::vector<double>;

constexpr double kReferenceTime = 0.01;  // s, as the predictive preset's

/// Variances of a Kalman filter of which the fluctuations are tuned; those of the encoder scale all of them.
WheelBeliefParameters noise(double speed, double disturbance) {
  WheelBeliefParameters noise;
  noise.speed_process_noise = speed;
  noise.disturbance_process_noise = disturbance;
  return noise;
}

/// The drive train behind the motors' dead zone, for which WheelwiseController makes up.
PlantModel linear(PlantModel model) {
  model.offset = 0.0;
  return model;
}

/// A baseline of regulators. @param regulator made of values, model and wheel radius.
template <class Maker>
Baseline regulated(std::string name, std::string title, std::vector<Tunable> tuned, const Maker& regulator) {
  return {std::move(name), std::move(title), std::move(tuned),
          [regulator](const Values& values, const PlantModel& model, const GeometryParameters& geometry) {
            const double radius = geometry.wheel_radius;
            const auto law = [&, behind = linear(model)] {
              return std::make_unique<PathFollower>(behind, radius, kReferenceTime, regulator(values, behind, radius));
            };
            return std::make_unique<WheelwiseController>(geometry, law, DeadZone(model));
          }};
}

const Tunable kSpeedNoise{"speed_process_noise", 0.01, 1e-4, 10.0};
const Tunable kDisturbanceNoise{"disturbance_process_noise", 0.01, 1e-5, 100.0};

}  // namespace

std::vector<double> Baseline::start() const {
  std::vector<double> values;
  std::transform(tuned.begin(), tuned.end(), std::back_inserter(values), [](const Tunable& t) { return t.start; });
  return values;
}

const std::vector<Baseline>& controlBaselines() {
  using Regulated = std::unique_ptr<Regulator>;
  static const std::vector<Baseline> list{
      regulated("simc_pi", "PI by SIMC (Skogestad 2003)", {{"tau_c", 0.1, 1e-3, 2.0}},
                [](const Values& v, const PlantModel& model, double) -> Regulated {
                  return std::make_unique<Pid>(simcGains(model, v[0], false));
                }),
      regulated("simc_pid", "PID by SIMC (Grimholt and Skogestad 2018)", {{"tau_c", 0.1, 1e-3, 2.0}},
                [](const Values& v, const PlantModel& model, double) -> Regulated {
                  return std::make_unique<Pid>(simcGains(model, v[0], true));
                }),
      regulated("pid", "PID, every gain searched",
                {{"proportional", 0.1, 1e-3, 10.0}, {"integral", 3.0, 1e-2, 100.0}, {"derivative", 1e-3, 1e-5, 0.3}},
                [](const Values& v, const PlantModel&, double) -> Regulated {
                  return std::make_unique<Pid>(PidGains{v[0], v[1], v[2]});
                }),
      regulated("smith_pi", "PI with Smith predictor (Smith 1957)",
                {{"proportional", 0.3, 1e-3, 10.0}, {"integral", 5.0, 1e-2, 200.0}},
                [](const Values& v, const PlantModel& model, double radius) -> Regulated {
                  return std::make_unique<SmithPredictor>(model, radius, PidGains{v[0], v[1], 0.0});
                }),
      regulated("lqg", "LQG with delay augmentation",
                {kSpeedNoise, kDisturbanceNoise, {"command_weight", 1.0, 1e-3, 1e4}},
                [](const Values& v, const PlantModel& model, double radius) -> Regulated {
                  return std::make_unique<Lqg>(model, radius, LqgWeights{noise(v[0], v[1]), 1.0, v[2]});
                }),
      regulated("adrc", "linear ADRC (Gao 2003; Zhao and Gao 2014)",
                {{"controller_bandwidth", 5.0, 0.1, 1000.0},
                 {"observer_bandwidth", 15.0, 0.5, 300.0},
                 {"input_gain", 30.0, 1.0, 1000.0}},
                [](const Values& v, const PlantModel& model, double) -> Regulated {
                  return std::make_unique<Adrc>(model, AdrcTuning{v[0], v[1], v[2]});
                }),
      {"mpc",
       "MPC with the acceleration limit",
       {kSpeedNoise, kDisturbanceNoise, {"change_weight", 0.3, 1e-3, 1e3}},
       [](const Values& v, const PlantModel& model, const GeometryParameters& geometry) {
         const auto law = [&] {
           return std::make_unique<ModelPredictive>(linear(model), geometry.wheel_radius,
                                                    MpcTuning{noise(v[0], v[1]), v[2]});
         };
         return std::make_unique<WheelwiseController>(geometry, law, DeadZone(model));
       }},
      regulated(
          "delayed_inference", "delayed feedback active inference (Ji et al. 2023)",
          {{"prediction_share", 0.5, 1e-3, 0.999}, {"proportional", 0.3, 1e-3, 10.0}, {"integral", 3.0, 1e-2, 200.0}},
          [](const Values& v, const PlantModel& model, double radius) -> Regulated {
            return std::make_unique<DelayedInference>(model, radius, DelayedInferenceGains{v[0], v[1], v[2]});
          })};
  return list;
}

}  // namespace jackal_aic::sim
