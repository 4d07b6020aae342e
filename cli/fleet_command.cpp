// SPDX-License-Identifier: Apache-2.0
// `report --fleet`: a page about all units of a store.
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/report/fleet_report.hpp"
#include "axiscal/store/store.hpp"
#include "core/formatted.hpp"
#include "report_options.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

// Checks that the calibrations are of one kind and one model of instrument. The coefficients of
// different designs have no common distribution.
void require_one_design(const Store& store, const StoreFilter& filter, const std::string& name) {
  std::map<std::string, std::size_t> kinds;
  std::map<std::string, std::size_t> models;
  for (const StoreCount& one : store.counts(filter)) {
    if (!one.kind.empty()) {  // a test without a record has no kind
      kinds[one.kind] += one.count;
      models[one.model] += one.count;
    }
  }
  const auto require_one = [&](const std::map<std::string, std::size_t>& counts, const char* what,
                               const char* option) {
    std::string list;
    for (const auto& [value, count] : counts) {
      list += formatted("{}'{}' ({})", list.empty() ? "" : ", ", value, count);
    }
    if (counts.size() > 1) {
      throw DataError(
          name, formatted("the store contains tests of several {}: {}; choose one with {}", what,
                          list, option));
    }
  };
  if (kinds.empty()) {
    throw DataError(name, "no calibration in this store matches the options");
  }
  require_one(kinds, "kinds", "--kind");
  require_one(models, "models", "--model");
}

// Returns the limits in the file of --limits. Without this option, returns the limits in the newest
// record that has a verdict (passed or failed).
std::vector<Limit> limits_of(const ReportCommand& command,
                             const Store& store,
                             const StoredCalibration& newest_judged) {
  if (command.limits) {
    return read_limits(*command.limits).limits;
  }
  std::vector<Limit> limits;
  if (newest_judged.digest.empty()) {
    return limits;
  }
  const auto add = [&](const StoredCalibration& one) {
    if (one.digest == newest_judged.digest) {
      const Calibration record = parse_calibration(one.record, one.serial);
      for (const LimitVerdict& limit : record.findings.verdict->limits) {
        limits.push_back({.parameter = limit.parameter, .low = limit.low, .high = limit.high});
      }
    }
  };
  store.for_each({.serial = newest_judged.serial}, StoredPart::record, add);
  return limits;
}

bool is_shown(const std::string& parameter) {
  return parameter.ends_with(".bias") || parameter.find(".sensitivity.") != std::string::npos;
}

}  // namespace

int run_fleet(const ReportCommand& command) {
  if (!command.record.empty()) {
    throw UsageError("report: give either a RECORD or --fleet STORE, not both");
  }
  if (!command.output.ends_with(".html") && !command.output.ends_with(".htm") &&
      command.output != "-") {
    throw UsageError(formatted("report --fleet: -o must end in .html, not '{}'", command.output));
  }
  const Store store(*command.fleet, Store::Access::read);
  const StoreFilter filter{
      .model = command.model, .kind = command.kind, .since = command.since, .until = command.until};
  const std::size_t slash = command.fleet->find_last_of('/');
  Fleet fleet{.kind = {}, .model = {}, .source = command.fleet->substr(slash + 1)};
  require_one_design(store, filter, fleet.source);
  StoredCalibration newest_judged;
  const auto add = [&](const StoredCalibration& one) {
    FleetTest test{.serial = one.serial + (one.slot.empty() ? "" : "/" + one.slot),
                   .date = one.date(),
                   .station = one.station,
                   .operated_by = one.operated_by,
                   .batch = one.batch,
                   .reason = one.reason,
                   .passed = is_good(one.passed, one.status)};
    if (!one.kind.empty()) {
      fleet.kind = one.kind;
      fleet.model = one.model;
    }
    if (one.passed && one.date() >= newest_judged.date()) {
      newest_judged = one;
    }
    if (fleet.parameters.empty()) {
      for (const StoredCoefficient& coefficient : one.coefficients) {
        if (is_shown(coefficient.name)) {
          fleet.parameters.push_back({.name = coefficient.name});
        }
      }
    }
    for (const FleetParameter& parameter : fleet.parameters) {
      const StoredCoefficient* const found = one.coefficient(parameter.name);
      test.values.push_back(found != nullptr ? found->value : not_a_number);
      test.u.push_back(found != nullptr ? found->u : not_a_number);
      test.u_noise.push_back(found != nullptr ? found->u_noise : not_a_number);
    }
    fleet.tests.push_back(std::move(test));
  };
  store.for_each(filter, StoredPart::coefficients, add);
  if (command.kind || command.model) {  // tests without a record have no kind and no model
    StoreFilter errors = filter;
    errors.kind = "";
    errors.model = "";
    store.for_each(errors, StoredPart::none, add);
  }
  const std::vector<Limit> limits = limits_of(command, store, newest_judged);
  for (FleetParameter& parameter : fleet.parameters) {
    const auto limit = std::find_if(limits.begin(), limits.end(), [&](const Limit& one) {
      return one.parameter == parameter.name;
    });
    if (limit != limits.end()) {
      parameter.low = limit->low;
      parameter.high = limit->high;
    }
  }
  write_whole_file(command.output, fleet_report(fleet));
  return 0;
}

}  // namespace axiscal::cli
