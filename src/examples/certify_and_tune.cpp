// Certifies gains on a plant model before a wheel turns, and raises kappa_a as far as the margins allow.

#include <cstdio>

#include "jackal_aic/certificate/certificate.hpp"

int main() {
  using namespace jackal_aic;

  ControllerParameters gains;  // Table C-1
  const GeometryParameters geometry;
  PlantModel plant;       // what identify writes
  plant.dead_time = 0.1;  // s

  const LinearLoop loop(gains, geometry, plant);
  const Certificate before = certify(loop);
  std::printf("%s\n", advice(before, loop).c_str());

  const MarginBounds wanted{2.0, 0.05};  // factor on kappa_a, and s of dead time
  double low = 0.0, high = gains.kappa_a * before.gain_margin;
  while (high - low > 0.01 * high) {
    gains.kappa_a = 0.5 * (low + high);
    const bool keeps = certify(gains, geometry, plant).keeps(wanted);
    (keeps ? low : high) = gains.kappa_a;
  }
  gains.kappa_a = low;
  const Certificate after = certify(gains, geometry, plant);
  std::printf("kappa_a = %.2f keeps a gain margin of %.2f and a delay margin of %.3f s\n", gains.kappa_a,
              after.gain_margin, after.delay_margin);
}
