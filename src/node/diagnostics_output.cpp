#include "diagnostics_output.hpp"

namespace jackal_aic {
namespace {

/// Wall time in which a subscriber finds the commands at the start [s].
constexpr double kConnection = 2.0;

}  // namespace

DiagnosticsOutput::DiagnosticsOutput() {
  updater_.setHardwareID("jackal");
  updater_.add("Active inference controller", this, &DiagnosticsOutput::fill);
}

void DiagnosticsOutput::look(const DriveLoopStatus& status, const std::string& contender, const Figures& figures) {
  const bool changed = reason_.update(status, contender) || status.decision.status != last_status_;
  last_status_ = status.decision.status;
  const Look look{++looks_, status, contender};
  // What changed is told in its order. Of what is only counted, the newest is enough.
  if (changed || untold_) untold_ = !changes_.push(look);
  newest_.write(look);
  figures_.write(figures);
}

bool DiagnosticsOutput::tell(const Look& look) {
  if (look.number <= told_looks_) return false;
  told_looks_ = look.number;
  return report_.update(look.status, look.contender);
}

void DiagnosticsOutput::publish(const std::string& unheard) {
  if (unheard.empty()) heard_ = ros::WallTime::now();
  unheard_ = unheard;
  const StopCause missing = told_.missing.worst();
  if (const Figures* figures = figures_.read()) told_ = *figures;
  bool changed = told_.missing.worst() != missing;
  changes_.consume_all([&](const Look& look) { changed = tell(look) || changed; });
  if (const Look* look = newest_.read()) changed = tell(*look) || changed;
  // What happens is told at once, not with the next period.
  changed ? updater_.force_update() : updater_.update();
}

void DiagnosticsOutput::fill(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const bool lasted = (ros::WallTime::now() - heard_).toSec() > kConnection;
  report_.diagnose(status, told_.missing, lasted ? unheard_ : "");
  status.add("Rejected measurements", told_.rejected_measurements);
  status.add("Master reachable", told_.master_reachable ? "yes" : "no");
  status.add("Free energy", told_.free_energy);
}

}  // namespace jackal_aic
