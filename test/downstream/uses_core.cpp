// Every header, and something out of each library, so that each is linked.

#include <cstdio>

#include "every_header.hpp"

using namespace jackal_aic;

template <class Error, class Call>
bool throws(const Call& call) {
  try {
    call();
  } catch (const Error&) {
    return true;
  }
  return false;
}

int main() {
  ParameterMap map;
  addYamlText("plant_model: {dead_time: 0.1, lag: 0.05}", "text", map);
  DriveParameters parameters;
  parameters.controller = PredictiveParameters{};
  parameters.plant_model = readParameters<PlantModel>(map, "plant_model");
  DriveLoop loop(parameters, makeController(parameters));
  loop.setSetPoint({}, 0.0);
  loop.advance(0.0);
  const bool drives = loop.advance(0.02).has_value();
  const bool stable = certify(PredictiveParameters{}, *parameters.plant_model, *parameters.plant_model).stable();
  const bool refuses = throws<ParameterError>([] { readUrdfGeometry("no robot", {"left"}, {"right"}); });
  std::printf("drives %d, stable %d, refuses %d\n", drives, stable, refuses);
  return drives && stable && refuses ? 0 : 1;
}
