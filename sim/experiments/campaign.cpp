#include "campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <regex>

#include "parallel.hpp"
#include "progress_bar.hpp"

namespace jackal_aic::sim {
namespace {

namespace fs = std::filesystem;

/// One run of a campaign and where its result goes.
struct Task {
  std::size_t experiment;
  std::size_t row;
  Run run;
  std::string line;
  std::string trace;
};

std::vector<Task> tasksOf(const ExperimentTable& table, const std::vector<std::string>& names, const Shard& shard) {
  std::vector<Task> tasks;
  for (std::size_t e = 0; e < names.size(); ++e) {
    const std::vector<Run> runs = table.runs(names[e]);
    for (std::size_t row = 0; row < runs.size(); ++row) {
      if (shard.owns(row)) tasks.push_back({e, row, runs[row], "", ""});
    }
  }
  return tasks;
}

std::vector<std::string> linesOf(const std::string& path) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) lines.push_back(line + "\n");
  if (lines.empty()) throw ParameterError(path + ": is empty or cannot be read");
  return lines;
}

/// The shards of one file: path by index.
struct ShardSet {
  std::size_t count = 0;
  std::map<std::size_t, std::string> paths;
};

std::map<std::string, ShardSet> findShards(const std::vector<std::string>& sources) {
  static const std::regex pattern(R"((.+)\.([0-9]{1,6})-of-([0-9]{1,6})\.csv)");
  std::map<std::string, ShardSet> sets;
  for (const auto& source : sources) {
    if (!fs::is_directory(source)) throw ParameterError("'" + source + "': is not a directory");
    for (const auto& entry : fs::directory_iterator(source)) {
      const std::string file = entry.path().filename().string();
      std::smatch match;
      if (!std::regex_match(file, match, pattern)) continue;
      ShardSet& set = sets[match[1]];
      const std::size_t count = std::stoul(match[3]);
      if (set.count != 0 && set.count != count)
        throw ParameterError(entry.path().string() + ": shards of different counts");
      set.count = count;
      if (!set.paths.emplace(std::stoul(match[2]), entry.path().string()).second) {
        throw ParameterError(entry.path().string() + ": this shard is there twice");
      }
    }
  }
  return sets;
}

bool isTrace(const std::string& name) {
  static const std::string ending = "_traces";
  return name.size() > ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// Lines of all shards in the order of a whole campaign: row k of shard K is row (k N + K - 1); a trace begins with its
/// row.
std::string joined(const std::string& name, const ShardSet& set) {
  std::string header;
  std::map<std::size_t, std::string> rows;
  for (std::size_t index = 1; index <= set.count; ++index) {
    const auto path = set.paths.find(index);
    if (path == set.paths.end()) {
      throw ParameterError(fmt::format("{}: shard {} of {} is missing", name, index, set.count));
    }
    const std::vector<std::string> lines = linesOf(path->second);
    header = lines.front();
    for (std::size_t k = 1; k < lines.size(); ++k) {
      rows[isTrace(name) ? std::stoul(lines[k]) : (k - 1) * set.count + index - 1] += lines[k];
    }
  }
  std::string text = header;
  for (const auto& row : rows) text += row.second;
  return text;
}

}  // namespace

Shard Shard::parse(const std::string& text) {
  static const std::regex pattern("([0-9]{1,6})/([0-9]{1,6})");
  std::smatch match;
  Shard shard;
  if (std::regex_match(text, match, pattern)) {
    shard.index = std::stoul(match[1]);
    shard.count = std::stoul(match[2]);
    if (shard.index >= 1 && shard.index <= shard.count && shard.count <= 100000) return shard;
  }
  throw ParameterError("shard = '" + text + "': expected K/N with 1 <= K <= N <= 100000");
}

std::string Shard::suffix() const { return count == 1 ? "" : fmt::format(".{}-of-{}", index, count); }

void runCampaign(const ExperimentTable& table, const std::vector<std::string>& names, const std::string& directory,
                 const Shard& shard, unsigned jobs, bool show_progress) {
  std::vector<Task> tasks = tasksOf(table, names, shard);
  createDirectory(directory);
  ProgressBar bar("experiments", tasks.size(), show_progress);
  parallelFor(
      tasks.size(), jobs,
      [&](std::size_t i) {
        const RunResult result = tasks[i].run();
        tasks[i].line = resultLine(result.row);
        tasks[i].trace = traceLines(tasks[i].row, result);
      },
      [&](std::size_t finished) { bar.show(finished); });
  for (std::size_t e = 0; e < names.size(); ++e) {
    std::string rows = resultHeader();
    std::string traces = traceHeader();
    for (const Task& task : tasks) {
      if (task.experiment != e) continue;
      rows += task.line;
      traces += task.trace;
    }
    writeTable(directory, names[e] + shard.suffix() + ".csv", rows);
    writeTable(directory, names[e] + "_traces" + shard.suffix() + ".csv", traces);
  }
}

std::vector<std::string> mergeShards(const std::vector<std::string>& sources, const std::string& directory) {
  const auto sets = findShards(sources);
  if (sets.empty()) throw ParameterError("merge: no files NAME.K-of-N.csv found");
  std::map<std::string, std::string> files;
  for (const auto& [name, set] : sets) files[name] = joined(name, set);
  std::vector<std::string> names;
  for (const auto& [name, text] : files) {
    writeTable(directory, name + ".csv", text);
    if (!isTrace(name)) names.push_back(name);
  }
  return names;
}

void writeTable(const std::string& directory, const std::string& name, const std::string& text) {
  createDirectory(directory);
  writeText((fs::path(directory) / name).string(), text);
}

void writeText(const std::string& path, const std::string& text) {
  if (path == "-") {
    std::cout << text << std::flush;
    return;
  }
  std::ofstream file(path);
  if (!file || !(file << text) || !file.flush()) throw ParameterError("'" + path + "': cannot be written");
}

}  // namespace jackal_aic::sim
