#include "jackal_aic/aic/belief_update.hpp"

#include <Eigen/QR>
#include <unsupported/Eigen/MatrixFunctions>

namespace jackal_aic {

template class BeliefUpdate<GenerativeModel>;

Eigen::MatrixXd integrated(const Eigen::MatrixXd& A, double step, Integrator integrator) {
  const Eigen::Index n = A.rows();
  // exp([A I; 0 0] h) = [Phi Gamma; 0 I] (Van Loan), which needs no inverse of A; its first terms are Euler's (3-16).
  Eigen::MatrixXd augmented = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  augmented.topLeftCorner(n, n) = step * A;
  augmented.topRightCorner(n, n) = step * Eigen::MatrixXd::Identity(n, n);
  if (integrator == Integrator::exact) return augmented.exp().topRows(n);
  return Eigen::MatrixXd::Identity(n, 2 * n) + augmented.topRows(n);
}

Eigen::MatrixXd leastSquares(const Eigen::MatrixXd& sensory_map) {
  return sensory_map.completeOrthogonalDecomposition().pseudoInverse();
}

}  // namespace jackal_aic
