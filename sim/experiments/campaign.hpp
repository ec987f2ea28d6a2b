#pragma once

/// @file
/// Runs experiments on all cores, or one shard of them, and writes their CSV files.

#include <string>
#include <vector>

#include "experiment_table.hpp"

namespace jackal_aic::sim {

/// Part of a campaign: row i (from 0) of every experiment belongs to shard i mod count + 1.
struct Shard {
  std::size_t index = 1;  ///< K, from 1
  std::size_t count = 1;  ///< N

  /// "K/N" as a shard. @throws ParameterError if it is not two whole numbers with 1 <= K <= N <= 100000.
  static Shard parse(const std::string& text);

  /// True if the row belongs to this shard.
  bool owns(std::size_t row) const { return row % count == index - 1; }

  /// "" for a whole campaign, else ".K-of-N".
  std::string suffix() const;
};

/// Runs experiments and writes DIR/NAME.csv and DIR/NAME_traces.csv (with the shard's suffix before ".csv"). The files
/// do not depend on jobs. @param jobs threads (0: one per core); @param show_progress draws a progress bar on the error
/// output.
/// @throws ParameterError for an unknown name or a file that cannot be written.
void runCampaign(const ExperimentTable& table, const std::vector<std::string>& names, const std::string& directory,
                 const Shard& shard, unsigned jobs, bool show_progress);

/// Joins the shards found in some directories to the files a whole campaign would have written. Returns the names
/// joined.
/// @throws ParameterError if there is none, or one of a set is missing or there twice.
std::vector<std::string> mergeShards(const std::vector<std::string>& sources, const std::string& directory);

/// Writes a file of results into a directory, which is made if it is not there. @throws ParameterError if either cannot
/// be.
void writeTable(const std::string& directory, const std::string& name, const std::string& text);

/// Writes a file; "-" is the standard output. @throws ParameterError if it cannot be written.
void writeText(const std::string& path, const std::string& text);

}  // namespace jackal_aic::sim
