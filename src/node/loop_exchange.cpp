#include "loop_exchange.hpp"

namespace jackal_aic {

void LoopExchange::adoptGains(const ControllerParameters& gains) {
  const std::lock_guard<std::mutex> lock(requests_);
  thesis_gains_.write(gains);
}

void LoopExchange::adoptGains(const PredictiveParameters& gains) {
  const std::lock_guard<std::mutex> lock(requests_);
  predictive_gains_.write(gains);
}

void LoopExchange::setSlip(const SlipState& slip) {
  const std::lock_guard<std::mutex> lock(requests_);
  wanted_slip_.write(slip_ = slip);
}

void LoopExchange::freezeLearning(bool frozen) {
  const std::lock_guard<std::mutex> lock(requests_);
  frozen_.write(frozen);
}

SlipState LoopExchange::slip() const {
  const std::lock_guard<std::mutex> lock(requests_);
  if (const SlipState* believed = believed_slip_.read()) slip_ = *believed;
  return slip_;
}

void LoopExchange::apply(DriveLoop& loop, double now) {
  if (const ControllerParameters* gains = thesis_gains_.read()) loop.adoptGains(*gains, now);
  if (const PredictiveParameters* gains = predictive_gains_.read()) loop.adoptGains(*gains, now);
  if (const SlipState* slip = wanted_slip_.read()) loop.setSlip(*slip, now);
  if (const bool* frozen = frozen_.read()) loop.freezeLearning(*frozen, now);
}

void LoopExchange::tell(const DriveLoop& loop) {
  const auto* learning = dynamic_cast<const PredictiveController*>(&loop.controller());
  if (learning != nullptr) believed_slip_.write(learning->slip());
}

}  // namespace jackal_aic
