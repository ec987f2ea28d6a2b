#include "transcription.hpp"

#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic::benchmark {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A kron B.
MatrixXd kronecker(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd product(a.rows() * b.rows(), a.cols() * b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      product.block(i * b.rows(), j * b.cols(), b.rows(), b.cols()) = a(i, j) * b;
    }
  }
  return product;
}

/// Pi = diag(1/Sigma) kron I: precision of all orders of `channels` channels.
MatrixXd precision(const std::vector<double>& variances, int orders, int channels) {
  const VectorXd inverse = Eigen::Map<const VectorXd>(variances.data(), orders + 1).cwiseInverse();
  return kronecker(inverse.asDiagonal().toDenseMatrix(), MatrixXd::Identity(channels, channels));
}

}  // namespace

Transcription::Transcription(const ControllerParameters& controller, const GeometryParameters& geometry)
    : controller_(controller), sensory_map_(SkidSteerKinematics(geometry).sensoryMap()) {}

void Transcription::step(VectorXd& mu, const VectorXd& y, const VectorXd& mu_d) const {
  const int p = controller_.orders;
  const MatrixXd I = MatrixXd::Identity(kBodySize, kBodySize);
  MatrixXd shift = MatrixXd::Zero(p + 1, p + 1);
  for (int i = 0; i < p; ++i) shift(i, i + 1) = 1.0;
  const MatrixXd D = kronecker(shift, I);
  const MatrixXd E = D + MatrixXd::Identity(D.rows(), D.cols()) / controller_.tau;
  const MatrixXd R = kronecker(MatrixXd::Identity(p + 1, p + 1), sensory_map_);
  const MatrixXd Pi_y = precision(controller_.sensory_variances, p, kSensorSize);
  const MatrixXd Pi_mu = precision(controller_.state_variances, p, kBodySize);

  const VectorXd eps_y = y - R * mu;                        // (3-6)
  const VectorXd eps_mu = E * mu - mu_d / controller_.tau;  // (3-7)
  const VectorXd gradient = E.transpose() * (Pi_mu * eps_mu) - R.transpose() * (Pi_y * eps_y);
  mu += controller_.beliefStep() * (D * mu - controller_.kappa_mu * gradient);  // (3-11), (3-16)
}

}  // namespace jackal_aic::benchmark
