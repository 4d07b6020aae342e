// SPDX-License-Identifier: Apache-2.0
// `axiscal store`: keeps calibrations in a database.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/store/store.hpp"
#include "core/formatted.hpp"
#include "core/json_pieces.hpp"
#include "core/redirected_streams.hpp"
#include "input.hpp"
#include "json_lines.hpp"
#include "store_client.hpp"
#include "store_options.hpp"
#include "stream_files.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string digest_of_limits(const Verdict& verdict) {
  std::string text = verdict.rule;
  for (const LimitVerdict& limit : verdict.limits) {
    text += formatted(";{}:{}:{}", limit.parameter, limit.low ? number_text(*limit.low) : "",
                      limit.high ? number_text(*limit.high) : "");
  }
  return sha256_of_text(text);
}

// Returns the limits that are not met. The text contains no measured values, so that units with the
// same failure have the same text.
std::string reasons_of(const Verdict& verdict) {
  std::string text;
  for (const LimitVerdict& limit : verdict.limits) {
    if (!limit.passed) {
      const bool is_low = limit.low && limit.value - limit.guard_band < *limit.low;
      text += formatted("{}{} {} {}", text.empty() ? "" : ", ", limit.parameter,
                        is_low ? "below" : "above",
                        number_text((is_low ? limit.low : limit.high).value_or(limit.value), 6));
    }
  }
  return text;
}

// Parses a line that `calibrate --stream` wrote for an instrument without a record: {"format":
// "axiscal-refusal", ..}.
StoredCalibration refusal_of(const std::string& line, const std::string& place) {
  try {
    const Json json = Json::parse(line);
    return {.serial = json.at("serial"),
            .kind = json.value("kind", ""),
            .computed = output_timestamp(),
            .status = json.at("result") == "refused" ? "refused" : "error",
            .reason = json.at("reason"),
            .inputs = json.at("sha256"),
            .digest = sha256_of_text(line),
            .record = line};
  } catch (const Json::exception& error) {
    throw DataError(place,
                    std::string("is not a refused unit of `calibrate --stream`: ") + error.what());
  }
}

StoredCalibration calibration_of(const std::string& line, const std::string& place) {
  const Calibration calibration = parse_calibration(line, place);
  const Instrument& instrument = calibration.sensor.instrument;
  const std::optional<Verdict>& verdict = calibration.findings.verdict;
  StoredCalibration one{.serial = instrument.serial,
                        .slot = calibration.provenance.slot,
                        .model = instrument.model,
                        .kind = instrument.kind,
                        .unit = instrument.unit,
                        .measured = calibration.provenance.measured,
                        .computed = calibration.provenance.created,
                        .status = std::string(status_name(calibration.status())),
                        .operated_by = calibration.provenance.operated_by,
                        .digest = record_digest(line),
                        .record = line};
  if (verdict) {
    one.passed = verdict->passed;
    one.limits = digest_of_limits(*verdict);
  }
  if (one.passed == false) {
    one.reason = reasons_of(*verdict);
  } else if (one.status != "ok" && !calibration.findings.warnings.empty()) {
    one.reason = warning_name(calibration.findings.warnings.front().code);
  }
  one.inputs = digests_of(calibration.provenance.inputs);
  const std::vector<ParameterUncertainty> parameters = parameter_uncertainties(calibration);
  const Eigen::MatrixXd of_readings =
      parameters.empty() ? Eigen::MatrixXd() : calibration.fit.statistics->covariance_of_readings();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto place = static_cast<Eigen::Index>(k);
    one.coefficients.push_back({.name = parameters[k].name,
                                .value = parameters[k].value,
                                .u = parameters[k].uncertainty.u,
                                .u_noise = std::sqrt(of_readings(place, place)),
                                .expanded = parameters[k].uncertainty.expanded});
  }
  return one;
}

// Parses one line of input: a record, a refusal, or a record with its origin from stored_line().
// @param place  file and line, for messages.
StoredCalibration stored_calibration(const std::string& text, const std::string& place) {
  const auto pieces = json_pieces(
      text, std::array<std::string_view, 4>{"/format", "/station", "/batch", "/record"});
  if (!pieces) {
    throw DataError(place, "is not a calibration record: it must be a JSON object");
  }
  const auto& [format, station, batch, record] = *pieces;
  if (!record.empty()) {
    StoredCalibration one = stored_calibration(std::string(record), place);
    one.station = station.empty() ? "" : Json::parse(station).get<std::string>();
    one.batch = batch.empty() ? "" : Json::parse(batch).get<std::string>();
    return one;
  }
  const std::string line = in_one_line(text);
  return format == "\"axiscal-refusal\"" ? refusal_of(line, place) : calibration_of(line, place);
}

StoreFilter filter_of(const StoreCommand& command) {
  return {.serial = command.serial,
          .slot = command.slot,
          .model = command.model,
          .kind = command.kind,
          .status = command.status,
          .station = command.station,
          .batch = command.batch,
          .operated_by = command.operated_by,
          .since = command.since,
          .until = command.until};
}

// Adds records to a store. It writes several records in one transaction.
class Adder {
 public:
  explicit Adder(const StoreCommand& command)
      : command_(command), store_(command.store, Store::Access::write) {}

  void add(const std::string& text, const std::string& place) {
    StoredCalibration one = stored_calibration(text, place);
    one.station = command_.station.value_or(one.station);
    one.batch = command_.batch.value_or(one.batch);
    (store_.add(one) ? added_ : present_) += 1;
    constexpr std::size_t most = 1000;
    constexpr std::chrono::milliseconds longest(200);
    if (++pending_ == most || std::chrono::steady_clock::now() - committed_ > longest) {
      commit();
    }
  }

  void commit() {
    store_.commit();
    pending_ = 0;
    committed_ = std::chrono::steady_clock::now();
  }

  [[nodiscard]] std::size_t added() const { return added_; }
  [[nodiscard]] std::size_t present() const { return present_; }

 private:
  const StoreCommand& command_;
  Store store_;
  std::size_t added_ = 0;
  std::size_t present_ = 0;
  std::size_t pending_ = 0;
  std::chrono::steady_clock::time_point committed_ = std::chrono::steady_clock::now();
};

// Adds the records in the text of a file: one record, or an array of records.
void add_document(Adder& adder, const std::string& text, const std::string& path) {
  const std::optional<std::vector<std::string_view>> list = list_of_piece(text);
  if (!list) {
    adder.add(text, path);
    return;
  }
  for (const std::string_view one : *list) {
    adder.add(std::string(one), path);
  }
}

void add_file(Adder& adder, const std::string& path) {
  std::size_t number = 0;
  const auto add_line = [&](std::string_view line) {
    ++number;
    if (!line.empty()) {
      adder.add(std::string(line), formatted("{}:{}", path == "-" ? "stdin" : path, number));
    }
    return true;
  };
  if (std::filesystem::is_directory(path)) {
    const RecordTexts files = records_in_folder(path);
    for (std::size_t i = 0; i < files.names.size(); ++i) {
      add_document(adder, files.text(i), files.names[i]);
    }
  } else if (path == "-") {
    for_each_line(
        path, [&](std::string_view line, bool) { add_line(line); }, largest_whole_file);
  } else if (path.ends_with(".jsonl") || path.ends_with(".jsonl.zst")) {
    read_complete_lines(path, add_line);
  } else {
    add_document(adder, read_whole_file(path), path);
  }
}

int add(const StoreCommand& command) {
  if (command.files.empty()) {
    throw UsageError("store add: name files of records, a folder of records, or - for stdin");
  }
  Adder adder(command);
  const auto told = [&] {
    return formatted("records added: {}; already stored: {}", adder.added(), adder.present());
  };
  try {
    for (const std::string& file : command.files) {
      add_file(adder, file);
    }
  } catch (const DataError&) {
    adder.commit();  // stores the records that were read before the error
    print_remark("note", told());
    throw;
  }
  adder.commit();
  if (command.json) {
    write_whole_file("-",
                     Json{{"added", adder.added()}, {"present", adder.present()}}.dump() + "\n");
  } else {
    print_line(told());
  }
  return 0;
}

std::string passed_text(const std::optional<bool>& passed) {
  return !passed ? "" : *passed ? "pass" : "fail";
}

// The columns that precede the coefficients in a table of calibrations.
const std::vector<std::pair<const char*, std::string (*)(const StoredCalibration&)>>& columns() {
  using One = const StoredCalibration&;
  static const std::vector<std::pair<const char*, std::string (*)(One)>> all = {
      {"serial", [](One one) { return one.serial; }},
      {"slot", [](One one) { return one.slot; }},
      {"kind", [](One one) { return one.kind; }},
      {"model", [](One one) { return one.model; }},
      {"date", [](One one) { return one.date(); }},
      {"status", [](One one) { return one.status; }},
      {"verdict", [](One one) { return passed_text(one.passed); }},
      {"reason", [](One one) { return one.reason; }},
      {"station", [](One one) { return one.station; }},
      {"operator", [](One one) { return one.operated_by; }},
      {"batch", [](One one) { return one.batch; }},
      {"inputs", [](One one) { return one.inputs; }},
      {"digest", [](One one) { return one.digest; }}};
  return all;
}

std::string row_of(const StoredCalibration& one) {
  std::vector<std::string> cells;
  for (const auto& [name, text] : columns()) {
    cells.push_back(formula_safe_cell(text(one)));
  }
  return joined(cells, ",");
}

std::string header_of_columns() {
  std::string header;
  for (const auto& [name, text] : columns()) {
    header += (header.empty() ? "" : ",") + std::string(name);
  }
  return header;
}

// Prints the number of good calibrations and the total number. Then prints the reasons why the
// others are not good, the most frequent reason first.
int print_yield(const StoreCommand& command, const Store& store) {
  std::size_t all = 0;
  std::size_t good = 0;
  std::map<std::string, std::size_t> reasons;
  for (const StoreCount& one : store.counts(filter_of(command))) {
    all += one.count;
    if (is_good(one.passed, one.status)) {
      good += one.count;
    } else {
      reasons[one.reason.empty() ? one.status : one.reason] += one.count;
    }
  }
  std::vector<std::pair<std::string, std::size_t>> sorted(reasons.begin(), reasons.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  if (command.json) {
    Json list = Json::array();
    for (const auto& [reason, count] : sorted) {
      list.push_back({{"reason", reason}, {"count", count}});
    }
    write_whole_file(
        command.output,
        Json{{"calibrations", all}, {"good", good}, {"reasons", std::move(list)}}.dump(2) + "\n");
    return 0;
  }
  std::string text =
      formatted("good calibrations: {} of {} ({:.1f} %)\n", good, all,
                all == 0 ? 0.0 : 100.0 * static_cast<double>(good) / static_cast<double>(all));
  for (const auto& [reason, count] : sorted) {
    text += formatted("{:>8}  {}\n", count, printable_text(reason));
  }
  write_whole_file(command.output, text);
  return 0;
}

int list(const StoreCommand& command) {
  const Store store(command.store, Store::Access::read);
  if (command.yield) {
    return print_yield(command, store);
  }
  OutputFile file(command.output);
  JsonLines lines;
  const auto put = [&](const std::string& row) { file.write(command.json ? lines.of(row) : row); };
  put(header_of_columns() + "\n");
  store.for_each(filter_of(command), StoredPart::none,
                 [&](const StoredCalibration& one) { put(row_of(one) + "\n"); });
  file.commit();
  return 0;
}

int show(const StoreCommand& command) {
  if (!command.serial) {
    throw UsageError("store show: needs --serial NAME");
  }
  if (command.at && !parse_date(*command.at)) {
    throw UsageError(formatted("--at: '{}' is not a date (ISO 8601)", *command.at));
  }
  const Store store(command.store, Store::Access::read);
  write_whole_file(command.output, store.held(filter_of(command), command.at).record + "\n");
  return 0;
}

// Writes a table with one row per calibration. Each coefficient that occurs in any calibration has
// a column.
void export_table(const Store& store, const StoreFilter& filter, const std::string& output) {
  std::vector<std::string> names;
  store.for_each(filter, StoredPart::coefficients, [&](const StoredCalibration& one) {
    for (const StoredCoefficient& coefficient : one.coefficients) {
      if (std::find(names.begin(), names.end(), coefficient.name) == names.end()) {
        names.push_back(coefficient.name);
      }
    }
  });
  OutputFile file(output);
  std::string header = header_of_columns();
  for (const std::string& name : names) {
    header += formatted(",{},{}", formula_safe_cell(name), formula_safe_cell("U_" + name));
  }
  file.write(header + "\n");
  store.for_each(filter, StoredPart::coefficients, [&](const StoredCalibration& one) {
    std::string row = row_of(one);
    for (const std::string& name : names) {
      const StoredCoefficient* const found = one.coefficient(name);
      row += "," + (found != nullptr ? number_text(found->value) : "") + "," +
             (found != nullptr && !std::isnan(found->expanded) ? number_text(found->expanded) : "");
    }
    file.write(row + "\n");
  });
  file.commit();
}

// Returns the file name of a record. It consists of serial number, slot, date, and the first eight
// digits of the digest, which make the name unique.
std::string file_name_of(const StoredCalibration& one) {
  std::string name = one.serial.empty() ? "no-serial" : one.serial;
  name +=
      (one.slot.empty() ? "" : "-" + one.slot) + "-" + one.date() + "-" + one.digest.substr(0, 8);
  for (char& c : name) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
    c = is_plain ? c : '_';
  }
  return name + ".json";
}

int export_records(const StoreCommand& command) {
  const Store store(command.store, Store::Access::read);
  const StoreFilter filter = filter_of(command);
  const std::string& output = command.output;
  if (output.ends_with(".csv")) {
    export_table(store, filter, output);
  } else if (output == "-" || output.ends_with(".json")) {
    OutputFile file(output);
    store.for_each(filter, StoredPart::record,
                   [&](const StoredCalibration& one) { file.write(one.record + "\n"); });
    file.commit();
  } else if (output.ends_with(".jsonl") || output.ends_with(".jsonl.zst")) {
    LineFile file(output, 0);
    store.for_each(filter, StoredPart::record,
                   [&](const StoredCalibration& one) { file.write(one.record + "\n"); });
  } else {
    std::filesystem::create_directories(output);
    store.for_each(filter, StoredPart::record, [&](const StoredCalibration& one) {
      write_whole_file((std::filesystem::path(output) / file_name_of(one)).string(),
                       one.record + "\n");
    });
  }
  return 0;
}

// Compares a record with the values that the store keeps in columns for this record. Returns a
// description of the difference; empty if there is none.
std::string defect_of(const StoredCalibration& stored) {
  StoredCalibration own;
  try {
    own = stored_calibration(stored.record, "the record");
  } catch (const DataError& error) {
    return error.what();
  }
  if (own.digest != stored.digest) {
    return "the stored digest differs from the digest of the record";
  }
  const auto same_number = [](double a, double b) {
    return a == b || (std::isnan(a) && std::isnan(b));
  };
  const bool same_coefficients = std::equal(
      own.coefficients.begin(), own.coefficients.end(), stored.coefficients.begin(),
      stored.coefficients.end(), [&](const StoredCoefficient& a, const StoredCoefficient& b) {
        return a.name == b.name && same_number(a.value, b.value) && same_number(a.u, b.u) &&
               same_number(a.u_noise, b.u_noise) && same_number(a.expanded, b.expanded);
      });
  const bool same_head = own.serial == stored.serial && own.kind == stored.kind &&
                         own.model == stored.model && own.slot == stored.slot &&
                         own.status == stored.status && own.passed == stored.passed &&
                         own.measured == stored.measured;
  return !same_head ? "the database columns (serial, kind, status, ...) differ from the record"
         : !same_coefficients ? "the coefficients differ from the record"
                              : "";
}

int verify(const StoreCommand& command) {
  const Store store(command.store, Store::Access::read);
  const std::vector<StoreDefect> defects = store.verify(&defect_of);
  std::size_t all = 0;
  for (const StoreCount& one : store.counts({})) {
    all += one.count;
  }
  if (command.json) {
    Json list = Json::array();
    for (const StoreDefect& one : defects) {
      list.push_back({{"serial", one.serial}, {"date", one.date}, {"defect", one.defect}});
    }
    write_whole_file(command.output,
                     Json{{"calibrations", all}, {"defects", std::move(list)}}.dump(2) + "\n");
  } else {
    std::string text = formatted("calibrations: {}; defects: {}\n", all, defects.size());
    for (const StoreDefect& one : defects) {
      text += formatted(
          "{}, calibrated {}: "
          "{}\n",
          printable_text(one.serial), one.date, one.defect);
    }
    write_whole_file(command.output, text);
  }
  return defects.empty() ? 0 : 1;
}

int migrate(const StoreCommand& command) {
  Store store(command.store, Store::Access::migrate);
  const int before = store.version();
  store.migrate();
  print_line(before == store.version() ? formatted("the store already has version {} of the "
                                                   "schema",
                                                   before)
                                       : formatted("the schema was updated from version {} to "
                                                   "{}",
                                                   before, store.version()));
  return 0;
}

}  // namespace

int run_store(const StoreCommand& command) {
  static const std::map<std::string, int (*)(const StoreCommand&)> actions = {
      {"add", &add},       {"list", &list},      {"show", &show}, {"export", &export_records},
      {"verify", &verify}, {"migrate", &migrate}};
  const auto action = actions.find(command.action);
  if (action == actions.end()) {
    throw UsageError(formatted(
        "store: '{}' must be one of add, list, show, export, verify, migrate", command.action));
  }
  return action->second(command);
}

}  // namespace axiscal::cli
