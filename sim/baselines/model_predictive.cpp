#include "model_predictive.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace jackal_aic::sim {
namespace {

constexpr int kMostSweeps = 500;
constexpr double kSmallChange = 1e-9;  // of a multiplier [rad/s]

/// Rows less the row before; before the first there is nothing.
template <class Matrix>
Matrix differences(const Matrix& rows) {
  Matrix result = rows;
  result.bottomRows(rows.rows() - 1) -= rows.topRows(rows.rows() - 1);
  return result;
}

}  // namespace

ModelPredictive::ModelPredictive(const PlantModel& model, double wheel_radius, const MpcTuning& tuning)
    : gain_(model.gain),
      largest_change_(kPeriod * model.acceleration_limit / wheel_radius),
      change_weight_(tuning.change_weight),
      filter_(model, wheel_radius, tuning.noise, kPeriod),
      from_input_(Square::Zero()) {
  const DriveTrainResponse response = driveTrainResponse(model, kPeriod);
  // w_k = C (Aᵏ x + Σ Aᵏ⁻¹⁻ʲ B r_j)
  Eigen::Matrix2d power = Eigen::Matrix2d::Identity();
  for (int k = 0; k < kHorizon; ++k) {
    for (int j = 0; j + k < kHorizon; ++j) from_input_(j + k, j) = power.row(0).dot(response.input);
    power = (response.transition * power).eval();
    from_state_.row(k) = power.row(0);
  }
  const Square change = differences(Square(Square::Identity()));
  // H = Γ'Γ + ρ D'D
  inverse_ = (from_input_.transpose() * from_input_ + change_weight_ * change.transpose() * change).inverse();
  of_limit_ << differences(from_input_), -differences(from_input_);
}

void ModelPredictive::reset(double speed) {
  filter_.reset(speed);
  command_ = speed / gain_;
}

double ModelPredictive::act(double wanted) {
  const Eigen::Vector3d arrival = filter_.onArrival();
  const Inputs drift = from_state_ * arrival.head<2>();
  // r = H⁻¹ (Γ' (w_d − Φ x) + ρ D' e₁ r₋₁)
  Inputs slope = from_input_.transpose() * (Inputs::Constant(wanted) - drift);
  slope(0) += change_weight_ * (gain_ * command_ + arrival(2));
  Inputs change = differences(drift);
  change(0) -= arrival(0);
  Bounds bound;
  bound << Inputs::Constant(largest_change_) - change, Inputs::Constant(largest_change_) + change;
  command_ = (withinLimit(inverse_ * slope, bound)(0) - arrival(2)) / gain_;
  return command_;
}

ModelPredictive::Inputs ModelPredictive::withinLimit(const Inputs& free, const Bounds& bound) const {
  const Bounds beyond = of_limit_ * free - bound;
  if ((beyond.array() <= 0.0).all()) return free;
  const Eigen::Matrix<double, 2 * kHorizon, 2 * kHorizon> dual = of_limit_ * inverse_ * of_limit_.transpose();
  // λ_i ← max(0, λ_i + (M r* − b − P λ)_i/P_ii), P = M H⁻¹ M'
  Bounds multipliers = Bounds::Zero();
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double largest = 0.0;
    for (int i = 0; i < 2 * kHorizon; ++i) {
      const double before = multipliers(i);
      multipliers(i) = std::max(0.0, before + (beyond(i) - dual.row(i).dot(multipliers)) / dual(i, i));
      largest = std::max(largest, dual(i, i) * std::abs(multipliers(i) - before));
    }
    if (largest < kSmallChange) break;
  }
  // r = r* − H⁻¹ M' λ
  return free - inverse_ * of_limit_.transpose() * multipliers;
}

}  // namespace jackal_aic::sim
