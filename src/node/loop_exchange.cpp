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

void LoopExchange::setLearned(const LearnedModel& learned) {
  const std::lock_guard<std::mutex> lock(requests_);
  wanted_model_.write(learned_ = learned);
}

void LoopExchange::freezeLearning(bool frozen) {
  const std::lock_guard<std::mutex> lock(requests_);
  frozen_.write(frozen);
}

LearnedModel LoopExchange::learned() const {
  const std::lock_guard<std::mutex> lock(requests_);
  if (const LearnedModel* believed = believed_model_.read()) learned_ = *believed;
  return learned_;
}

void LoopExchange::apply(DriveLoop& loop, double now) {
  if (const ControllerParameters* gains = thesis_gains_.read()) loop.adoptGains(*gains, now);
  if (const PredictiveParameters* gains = predictive_gains_.read()) loop.adoptGains(*gains, now);
  if (const LearnedModel* learned = wanted_model_.read()) loop.setLearned(*learned, now);
  if (const bool* frozen = frozen_.read()) loop.freezeLearning(*frozen, now);
}

void LoopExchange::tell(const DriveLoop& loop) {
  if (loop.predictive() != nullptr) believed_model_.write(loop.predictive()->learned());
}

}  // namespace jackal_aic
