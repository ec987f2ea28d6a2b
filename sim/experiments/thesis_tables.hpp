#pragma once

/// @file
/// The thesis' tables (sim/thesis/tables.yaml) as structs.

#include <optional>
#include <string>
#include <vector>

#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// One pair of settling and rise time of a step response table.
struct ThesisStep {
  std::string table;               ///< "5-4"
  std::string row;                 ///< as printed
  std::string column;              ///< as printed; empty if the table has one pair of columns
  std::string controller;          ///< a name of controllerNames()
  std::string plant;               ///< a name of plantNames()
  double step = 0.0;               ///< [m/s]
  Overrides overrides;             ///< what differs from the controller
  std::optional<double> settling;  ///< [s]
  std::optional<double> rise;      ///< [s]
  bool unstable = false;           ///< the thesis calls the case unstable
};

/// One square wave of Table 5-10.
struct ThesisSquare {
  std::string row;  ///< as printed
  double minimum;   ///< [m/s]
  double maximum;   ///< [m/s]
};

/// One limit of Table 5-7.
struct ThesisLimit {
  std::string parameter;   ///< tau, kappa_mu or kappa_a
  std::string column;      ///< as printed
  bool is_minimum;         ///< smallest usable value instead of the largest
  std::string controller;  ///< whose other parameters hold
  std::string plant;       ///< a name of plantNames()
  Overrides overrides;     ///< what differs from the controller
  double value;            ///< as printed
};

/// Reader of the tables. Every function throws ParameterError if the table is missing, of another kind or incomplete.
class ThesisTables {
 public:
  /// @param path of tables.yaml. @throws ParameterError if it cannot be read.
  explicit ThesisTables(std::string path) : path_(std::move(path)) {}

  /// Rows of a step response table, in order of print.
  std::vector<ThesisStep> steps(const std::string& table) const;

  /// Rows of a table of square waves.
  std::vector<ThesisSquare> squares(const std::string& table) const;

  /// Rows of a table of usable ranges.
  std::vector<ThesisLimit> limits(const std::string& table) const;

 private:
  std::string path_;
};

}  // namespace jackal_aic::sim
