// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/calib/study.hpp"
#include "axiscal/core/error.hpp"
#include "calib/plan/src/study_blocks.hpp"
#include "core/json_document.hpp"

namespace axiscal {

std::int64_t block_count(const Study& study) {
  return study.block > 0 ? (study.trials + study.block - 1) / study.block : 0;
}

Study merge(const std::vector<Study>& shards) {
  if (shards.empty()) {
    throw DomainError("merge: needs at least one study");
  }
  Study all{.seed = shards.front().seed,
            .trials = shards.front().trials,
            .block = shards.front().block,
            .setup = shards.front().setup,
            .parameters = shards.front().parameters};
  std::vector<std::pair<std::int64_t, const std::vector<StudySums>*>> parts;
  for (const Study& shard : shards) {
    if (shard.seed != all.seed || shard.trials != all.trials || shard.setup != all.setup) {
      throw DomainError(
          "the shards are of different studies: their seeds, numbers of trials or settings "
          "differ");
    }
    if (all.parameters.empty()) {
      all.parameters = shard.parameters;
    }
    if (!shard.parameters.empty() && shard.parameters != all.parameters) {
      throw DomainError("the shards are of different studies: their parameters differ");
    }
    all.refused += shard.refused;
    add_counts(shard.warnings, all.warnings);
    for (std::size_t i = 0; i < shard.blocks.size(); ++i) {
      parts.emplace_back(shard.blocks[i], &shard.sums[i]);
    }
  }
  std::sort(parts.begin(), parts.end());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0 && parts[i].first == parts[i - 1].first) {
      throw DomainError("two shards contain the same trials; give each shard only once");
    }
    all.blocks.push_back(parts[i].first);
    all.sums.push_back(*parts[i].second);
  }
  return all;
}

std::vector<StudyResult> results_of(const Study& study) {
  std::vector<StudyResult> results;
  for (std::size_t p = 0; p < study.parameters.size(); ++p) {
    StudySums all;
    for (const std::vector<StudySums>& block : study.sums) {
      if (p < block.size()) {
        all.trials += block[p].trials;
        all.error += block[p].error;
        all.error_squared += block[p].error_squared;
        all.u_squared += block[p].u_squared;
        all.covered += block[p].covered;
      }
    }
    const double n = all.trials;
    StudyResult result{.parameter = study.parameters[p]};
    result.mean_error = all.error / n;
    result.sd =
        std::sqrt(std::max(0.0, (all.error_squared - n * result.mean_error * result.mean_error) /
                                    std::max(n - 1.0, 1.0)));
    result.stated_u = std::sqrt(all.u_squared / n);
    result.coverage_95 = all.covered / n;
    results.push_back(std::move(result));
  }
  return results;
}

std::string study_json(const Study& study, bool with_blocks) {
  Json json = {{"format", "axiscal-study"}, {"version", 1},
               {"seed", study.seed},        {"trials", study.trials},
               {"block", study.block},      {"setup", study.setup},
               {"refused", study.refused},  {"parameters", Json::array()}};
  for (const StudyResult& result : results_of(study)) {
    json["parameters"].push_back({{"parameter", result.parameter},
                                  {"mean_error", result.mean_error},
                                  {"sd", result.sd},
                                  {"stated_u", result.stated_u},
                                  {"coverage_95", result.coverage_95}});
  }
  if (!study.warnings.empty()) {
    json["warnings"] = study.warnings;
  }
  if (with_blocks) {
    json["blocks"] = Json::array();
    for (std::size_t i = 0; i < study.blocks.size(); ++i) {
      Json sums = Json::array();
      for (const StudySums& one : study.sums[i]) {
        sums.push_back({one.trials, one.error, one.error_squared, one.u_squared, one.covered});
      }
      json["blocks"].push_back({{"block", study.blocks[i]}, {"sums", sums}});
    }
  }
  return json_text(json);
}

Study parse_study(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-study");
  Study study;
  study.seed = static_cast<std::uint64_t>(json.at("seed").number());
  study.trials = static_cast<std::int64_t>(json.at("trials").number());
  study.block = static_cast<std::int64_t>(json.at("block").number());
  study.setup = json.text_or("setup");
  study.refused = static_cast<std::int64_t>(json.at("refused").number());
  for (const JsonValue& parameter : json.at("parameters").elements()) {
    study.parameters.push_back(parameter.at("parameter").text());
  }
  if (const std::optional<JsonValue> warnings = json.find("warnings")) {
    for (const std::string& name : warnings->keys()) {
      study.warnings[name] = static_cast<std::int64_t>(warnings->at(name).number());
    }
  }
  if (!json.find("blocks")) {
    json.fail(
        "this study lacks the sums of its blocks, which only a shard of a study contains: run the "
        "study as a shard, for example 1/1");
  }
  constexpr Eigen::Index numbers = 5;
  for (const JsonValue& block : json.at("blocks").elements()) {
    study.blocks.push_back(static_cast<std::int64_t>(block.at("block").number()));
    std::vector<StudySums>& sums = study.sums.emplace_back();
    for (const JsonValue& one : block.at("sums").elements()) {
      const Eigen::VectorXd v = one.vector(numbers);
      sums.push_back({.trials = v(0),
                      .error = v(1),
                      .error_squared = v(2),
                      .u_squared = v(3),
                      .covered = v(4)});
    }
  }
  return study;
}

}  // namespace axiscal
