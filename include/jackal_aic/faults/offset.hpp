#pragma once

/// @file
/// A constant of unknown size in the prediction errors of a faulty sensor.

#include <cmath>

#include "jackal_aic/faults/density.hpp"

namespace jackal_aic::faults {

/// e = h b + healthy error, b ~ N(0, prior) and |b| > least when it begins; constant from then on. What begins may jump
/// and what stays is constant: both have a density of their own. Errors e, their healthy variance S and the factor h
/// are those of the sample.
class Offset {
 public:
  /// @param prior variance of b; @param least smallest |b| that is a fault.
  explicit Offset(double prior, double least = 0.0) : prior_(prior), least_(least), b_{0.0, prior} {}

  /// ln p(e) of an offset that was there before.
  double stays(double e, double S, double h = 1.0) const {
    return logStudent(square(e - h * b_.mean), S + h * h * b_.variance) + beyond(posterior(b_, e, S, h)) - beyond(b_);
  }

  /// ln p(e) of one that begins with this sample.
  double begins(double e, double S, double h = 1.0) const {
    const Normal b{0.0, prior_};
    return logNormal(e, S + h * h * prior_) + beyond(posterior(b, e, S, h)) - beyond(b);
  }

  /// Kalman update of b, a mixture of one that stays and one that begins. @param fresh weight of the latter.
  void update(double e, double S, double fresh, double h = 1.0) {
    mix(posterior(b_, e, S, h), posterior({0.0, prior_}, e, S, h), fresh);
  }

  /// The same. @param begins error with its variance, of which begins() was asked.
  void update(double e, double S, double fresh, const Normal& begins) {
    mix(posterior(b_, e, S, 1.0), posterior({0.0, prior_}, begins.mean, begins.variance, 1.0), fresh);
  }

 private:
  void mix(const Normal& stayed, const Normal& begun, double fresh) {
    const double mean = fresh * begun.mean + (1.0 - fresh) * stayed.mean;
    b_.variance = fresh * (begun.variance + square(begun.mean - mean)) +
                  (1.0 - fresh) * (stayed.variance + square(stayed.mean - mean));
    b_.mean = mean;
    if (beyond(b_) < std::log(kSpent)) b_ = {0.0, prior_};  // what is left of it has to begin again
  }

  static Normal posterior(const Normal& b, double e, double S, double h) {
    const double K = h * b.variance / (S + h * h * b.variance);
    return {b.mean + K * (e - h * b.mean), (1.0 - K * h) * b.variance};
  }
  double beyond(const Normal& b) const { return least_ == 0.0 ? 0.0 : logBeyond(b, least_); }

  static constexpr double kSpent = 0.01;  // least share of b beyond `least`
  double prior_, least_;
  Normal b_;
};

}  // namespace jackal_aic::faults
