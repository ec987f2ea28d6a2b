#include "jackal_aic/certificate/jitter_certificate.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "form_search.hpp"

namespace jackal_aic {
namespace {

using Eigen::MatrixXd;

constexpr double kTick = 1e-3;            // s, between steps of the belief: a sample counts at the next one
constexpr double kBeforeTick = 1e-9;      // s
constexpr std::size_t kMostRounds = 100;  // of the search, each with one edge more
constexpr double kReserve = 1.2;          // of what is left of maps, for the next forms
constexpr double kTighter = 0.999;        // of the growth that is wanted, from one try to the next
constexpr double kDelayStep = 0.005;      // s, of the margin

/// Maps of a period on which forms have to fall, and what is left of maps between them.
struct Maps {
  std::vector<MatrixXd> sampled, lost;
  std::vector<MatrixXd> residuals;
};

/// A range of phases or extra delays in which the map has no kink.
struct Cell {
  double low, high;

  double at(double part) const { return low + part * (high - low); }
};

/// Cells of the extra delay: they also end where an arrival passes from one period to the next.
std::vector<Cell> delayCells(const PredictiveLinearLoop& loop, double longest) {
  std::vector<double> ends{0.0, longest};
  for (double end = kTick; end < longest; end += kTick) ends.push_back(end);
  const double period = loop.period(), dead_time = loop.robot().dead_time;
  for (double kink = period * std::ceil(dead_time / period) - dead_time; kink < longest; kink += period) {
    ends.push_back(kink);
  }
  std::sort(ends.begin(), ends.end());
  std::vector<Cell> cells;
  for (std::size_t i = 1; i < ends.size(); ++i) {
    if (ends[i] - ends[i - 1] > kBeforeTick) cells.push_back({ends[i - 1], ends[i]});
  }
  return cells.empty() ? std::vector<Cell>{{0.0, 0.0}} : cells;
}

/// Cells of the phase: from one step of the belief to the next, where the sample counts a step earlier.
std::vector<Cell> phaseCells(const PredictiveLinearLoop& loop) {
  std::vector<Cell> cells;
  for (double low = 0.0; low < loop.longestPhase() - kBeforeTick; low += kTick) {
    cells.push_back({low, std::min(low + kTick, loop.longestPhase()) - kBeforeTick});
  }
  return cells;
}

/// Three values of a curve as the control points of the parabola through them, which is in the triangle of these.
std::array<MatrixXd, 3> controlPoints(const MatrixXd& low, const MatrixXd& middle, const MatrixXd& high) {
  return {low, 2.0 * middle - 0.5 * (low + high), high};
}

/// Weights of the control points at a quarter of the way.
constexpr std::array<double, 3> kQuarter{9.0 / 16.0, 6.0 / 16.0, 1.0 / 16.0};

/// The maps of a cell of phase and delay: the control points of the biquadratic surface through nine of its maps; and
/// how far it is from the map at a quarter of both ways.
template <class MapAt>
void addCell(const MapAt& map, const Cell& phase, const Cell& delay, std::vector<MatrixXd>& maps,
             std::vector<MatrixXd>& residuals) {
  const auto along_phase = [&](double d) {
    return controlPoints(map(phase.low, d), map(phase.at(0.5), d), map(phase.high, d));
  };
  const auto low = along_phase(delay.low), middle = along_phase(delay.at(0.5)), high = along_phase(delay.high);
  MatrixXd residual = map(phase.at(0.25), delay.at(0.25));
  for (std::size_t i = 0; i < 3; ++i) {
    const auto points = controlPoints(low[i], middle[i], high[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      residual -= kQuarter[i] * kQuarter[k] * points[k];
      maps.push_back(points[k]);
    }
  }
  residuals.push_back(residual);
}

Maps mapsOf(const PredictiveLinearLoop& loop, const Jitter& jitter) {
  const double longest = jitter.extra_delay;
  const std::vector<Cell> delays = delayCells(loop, longest), phases = phaseCells(loop);
  Maps maps;
  const auto lost = [&](double phase, double delay) { return loop.jitteredMap({phase, delay, {}}, longest); };
  for (const Cell& delay : delays) {
    if (jitter.lost_samples > 0) addCell(lost, {0.0, 0.0}, delay, maps.lost, maps.residuals);
    // A sample may come a period late by its phase, beside those that are lost.
    for (const Eigen::Vector3d& gain : loop.irregularGains(jitter.lost_samples + 2)) {
      const auto sampled = [&](double phase, double d) { return loop.jitteredMap({phase, d, gain}, longest); };
      for (const Cell& phase : phases) addCell(sampled, phase, delay, maps.sampled, maps.residuals);
    }
  }
  return maps;
}

/// Square root L of a form L L'.
using Root = MatrixXd;

/// The least g with M' P_after M <= g^2 P_before, or `enough` if it is not more than that.
double growth(const MatrixXd& map, const Root& before, const Root& after, double enough) {
  // g is the 2-norm of L_before⁻¹ M' L_after, which is not above the Frobenius norm.
  const MatrixXd scaled = before.triangularView<Eigen::Lower>().solve(map.transpose() * after);
  if (scaled.norm() <= enough) return enough;
  const MatrixXd square = scaled * scaled.transpose();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(square, Eigen::EigenvaluesOnly);
  return std::max(enough, std::sqrt(solver.eigenvalues().maxCoeff()));
}

/// The edges of all sequences: a sample leads to form 0, a lost one from j to j + 1.
std::vector<FormEdge> edgesOf(const std::vector<MatrixXd>& sampled, const std::vector<MatrixXd>& lost,
                              std::size_t forms) {
  std::vector<FormEdge> edges;
  for (std::size_t j = 0; j < forms; ++j) {
    for (const MatrixXd& map : sampled) edges.push_back({&map, j, 0});
    if (j + 1 == forms) break;
    for (const MatrixXd& map : lost) edges.push_back({&map, j, j + 1});
  }
  return edges;
}

/// The edge of the largest growth, and that.
std::pair<double, FormEdge> worstOf(const std::vector<FormEdge>& edges, const std::vector<Root>& roots) {
  std::pair<double, FormEdge> worst{0.0, {}};
  for (const FormEdge& edge : edges) {
    const double here = growth(*edge.map, roots[edge.before], roots[edge.after], worst.first);
    if (here > worst.first) worst = {here, edge};
  }
  return worst;
}

/// The largest growth of what is left of maps, from every form to every other.
double largestOf(const std::vector<MatrixXd>& residuals, const std::vector<Root>& roots) {
  double largest = 0.0;
  for (const MatrixXd& map : residuals) {
    for (const Root& after : roots) {
      for (const Root& before : roots) largest = growth(map, before, after, largest);
    }
  }
  return largest;
}

std::vector<Root> rootsOf(const FormSearch& search, std::size_t forms) {
  std::vector<Root> roots;
  for (std::size_t j = 0; j < forms; ++j) roots.emplace_back(search.form(j).llt().matrixL());
  return roots;
}

}  // namespace

double growthBound(const PredictiveLinearLoop& loop, const Jitter& jitter) {
  const Maps maps = mapsOf(loop, jitter);
  const std::size_t forms = static_cast<std::size_t>(jitter.lost_samples) + 1;
  const std::vector<FormEdge> all = edgesOf(maps.sampled, maps.lost, forms);
  FormSearch search(maps.sampled.front().rows(), forms);
  std::vector<FormEdge> edges{all.front()};
  double wanted = 1.0, least = std::numeric_limits<double>::infinity();
  for (std::size_t round = 0; round < kMostRounds && search.solve(edges, wanted); ++round) {
    const std::vector<Root> roots = rootsOf(search, forms);
    const auto [growth, worst] = worstOf(all, roots);
    if (growth >= wanted) {
      edges.push_back(worst);
      continue;
    }
    const double residual = largestOf(maps.residuals, roots);
    least = std::min(least, growth + residual);
    if (least < kStabilityLimit) break;
    wanted = std::min(1.0 - kReserve * residual, kTighter * wanted);
  }
  return least;
}

JitterMargins jitterMargins(const PredictiveLinearLoop& loop) {
  const auto largest = [&](int most, const auto& jitter) {
    int low = 0, high = most + 1;
    while (high - low > 1) {
      const int middle = (low + high) / 2;
      (growthBound(loop, jitter(middle)) < kStabilityLimit ? low : high) = middle;
    }
    return low;
  };
  JitterMargins margins;
  margins.any_phase = growthBound(loop, {}) < kStabilityLimit;
  if (!margins.any_phase) return margins;
  const auto steps = static_cast<int>(std::lround(kLongestJitter / kDelayStep));
  margins.delay = kDelayStep * largest(steps, [](int i) { return Jitter{kDelayStep * i, 0}; });
  margins.lost = largest(kMostLost, [](int i) { return Jitter{0.0, i}; });
  return margins;
}

}  // namespace jackal_aic
