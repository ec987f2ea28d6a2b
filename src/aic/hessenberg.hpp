#pragma once

/// @file
/// Eigenvalues of a real map by its Hessenberg form, without Schur form and vectors. Internal to the core.

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace jackal_aic {

/// H = Q' M Q with zeros below the first subdiagonal. What is zero already costs nothing: chains of delays are of that
/// form. Entries of less than 1e-145 may count as zeros.
Eigen::MatrixXd hessenbergForm(Eigen::MatrixXd map);

/// Eigenvalues of a Hessenberg form by QR steps with two shifts (Golub and Van Loan 2013, 7.5), of each conjugate pair
/// the one above the real axis. Empty if they do not converge.
std::vector<std::complex<double>> eigenvaluesOf(Eigen::MatrixXd hessenberg);

/// |x| |y| / |y' x| of an eigenvalue of a Hessenberg form, x and y by a step of inverse iteration each.
/// @param least pivot that counts.
double conditionNumber(const Eigen::MatrixXd& hessenberg, std::complex<double> eigenvalue, double least);

}  // namespace jackal_aic
