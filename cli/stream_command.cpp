// SPDX-License-Identifier: Apache-2.0
// `calibrate --stream`: calibrates many instruments (units) in sequence, in constant memory.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "axiscal/calib/history.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/printable_text.hpp"
#include "calibrate_command.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"
#include "input.hpp"
#include "json_lines.hpp"
#include "store_client.hpp"
#include "stream_files.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

// The readings of one unit (instrument) of the stream, as a separate table.
struct UnitText {
  std::string serial;
  std::string station, batch;  // from the unit's first reading; may be empty
  std::string csv;             // header and rows
  std::string error;           // reason why the unit cannot be read; otherwise empty
};

std::string cell_text(const nlohmann::json& value) {
  const std::string text = value.is_string() ? value.get<std::string>()
                           : value.is_null() ? std::string()
                                             : value.dump();
  if (text.find_first_of(",\"\n") == std::string::npos) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  }
  return quoted + "\"";
}

// Converts one line of JSON to a table in CSV. The line has the form
// {"serial": .., "readings": [{"rest": .., "x": ..}, ..]}.
UnitText unit_of_json(std::string_view line) {
  UnitText unit;
  try {
    const auto json = nlohmann::ordered_json::parse(line);
    unit.serial = cell_text(json.at("serial"));
    unit.station = json.value("station", "");
    unit.batch = json.value("batch", "");
    std::vector<std::string> names;
    for (const auto& [name, value] : json.at("readings").at(0).items()) {
      names.push_back(name);
      unit.csv += (unit.csv.empty() ? "" : ",") + cell_text(name);
    }
    unit.csv += "\n";
    for (const auto& reading : json.at("readings")) {
      for (std::size_t i = 0; i < names.size(); ++i) {
        unit.csv += (i > 0 ? "," : "") + cell_text(reading.at(names[i]));
      }
      unit.csv += "\n";
    }
  } catch (const nlohmann::json::exception& error) {
    unit.error = formatted(
        "the line does not have the form {{\"serial\": .., \"readings\": [..]}}: "
        "{}",
        error.what());
  }
  return unit;
}

// Splits the input into units. The input is a table of readings with a column `serial`, or it has
// one line of JSON for each unit.
class UnitReader {
 public:
  // @param columns, reading  describe the columns of a table.
  UnitReader(const std::string& path,
             const ObservationColumns& columns,
             const TableReading& reading)
      : file_(path), path_(path) {
    while (!text_starts() && read_more()) {
    }
    if (text_starts() && text_[start_of_text()] == '{') {
      return;
    }
    table_ = open_observations(path, columns, reading, [this](char* buffer, std::size_t size) {
      const std::size_t before = text_.copy(buffer, size, at_);
      at_ += before;
      return before > 0 ? before : file_.read(buffer, size);
    });
    const CsvReader& csv = *table_->csv;
    for (const std::string& name : csv.header()) {
      header_ += (header_.empty() ? "" : ",") + csv_cell(name);
    }
    header_ += "\n";
    serial_ = csv.column("serial");
    station_ = csv.column("station");
    batch_ = csv.column("batch");
    if (!serial_) {
      throw DataError(path_, csv.line(),
                      "the column 'serial' is missing; --stream needs it to separate the units");
    }
  }

  // Returns the next unit; nullopt at the end of the input.
  std::optional<UnitText> next() { return table_ ? next_of_table() : next_of_json(); }

 private:
  std::optional<UnitText> next_of_table() {
    CsvReader& csv = *table_->csv;
    for (;;) {
      const CsvReader::Row row = csv.next();
      if (row == CsvReader::Row::end) {
        return std::exchange(unit_, std::nullopt);
      }
      // A defective row makes its unit an error, but not the other units.
      const std::vector<std::string> split =
          row == CsvReader::Row::good ? std::vector<std::string>() : cells_of(csv.text());
      const auto cell = [&](const std::optional<std::size_t>& column) {
        if (column && row == CsvReader::Row::good) {
          return std::string(csv.cells()[*column]);
        }
        return column && *column < split.size() ? split[*column] : std::string();
      };
      std::optional<UnitText> complete;
      if (unit_ && unit_->serial != cell(serial_)) {
        complete = std::exchange(unit_, std::nullopt);
      }
      if (!unit_) {
        unit_ = UnitText{.serial = cell(serial_),
                         .station = cell(station_),
                         .batch = cell(batch_),
                         .csv = header_,
                         .error = {}};
      }
      unit_->csv += csv.text();
      unit_->csv += '\n';
      if (complete) {
        return complete;
      }
    }
  }

  std::optional<UnitText> next_of_json() {
    while (const std::optional<std::string> line = next_line()) {
      if (!trimmed(*line).empty() && line->front() != '#') {
        return unit_of_json(*line);
      }
    }
    return std::nullopt;
  }

  // Returns the index of the first character of text_ that is not in an empty line or a comment;
  // text_.size() if there is none.
  [[nodiscard]] std::size_t start_of_text() const {
    for (std::size_t at = 0; at < text_.size();) {
      at = std::min(text_.find_first_not_of(" \t\r\n", at), text_.size());
      if (at == text_.size() || text_[at] != '#') {
        return at;
      }
      at = std::min(text_.find('\n', at), text_.size());
    }
    return text_.size();
  }
  [[nodiscard]] bool text_starts() const { return start_of_text() < text_.size(); }

  // Appends the next bytes of the input to text_. Returns false at the end.
  bool read_more() {
    if (text_.size() > largest_whole_file) {
      throw DataError(path_, number_ + 1, "a line is longer than 256 MiB");
    }
    constexpr std::size_t piece = 1U << 16U;
    const std::size_t size = text_.size();
    text_.resize(size + piece);
    const std::size_t count = file_.read(text_.data() + size, piece);
    text_.resize(size + count);
    return count > 0;
  }

  std::optional<std::string> next_line() {
    for (;;) {
      const std::size_t end = text_.find('\n', at_);
      if (end != std::string::npos) {
        std::string line = text_.substr(at_, end - at_);
        at_ = end + 1;
        ++number_;
        return line;
      }
      text_.erase(0, at_);
      at_ = 0;
      if (!read_more()) {
        ++number_;
        return text_.empty() ? std::nullopt : std::optional(std::exchange(text_, ""));
      }
    }
  }

  InputFile file_;
  std::string path_;
  std::optional<OpenTable> table_;  // nullopt: lines of JSON
  std::string header_;              // first line of each unit's table
  std::optional<std::size_t> serial_, station_, batch_;
  std::optional<UnitText> unit_;
  std::string text_;  // bytes that were read but not used; the first at_ bytes are used
  std::size_t at_ = 0;
  std::size_t number_ = 0;
};

// The output lines of one unit.
struct StreamedUnit {
  std::string record, row;
  std::string stored;  // line for axiscal-store
  std::string result;
};

class Stream {
 public:
  explicit Stream(const CalibrateCommand& command)
      : command_(command), experiment_(make_experiment(command.experiment)) {
    if (command.limits) {
      limits_ = read_limits(*command.limits);
    }
    if (command.history) {
      earlier_ = read_records(named_records(*command.history));
    }
    if (command.shard) {
      shard_ = shard_of_option(*command.shard);
    }
    for (const std::string& axis : experiment_.instrument.axes) {
      for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
        parameters_.push_back(axis + of);
      }
    }
  }

  [[nodiscard]] const Experiment& experiment() const { return experiment_; }
  [[nodiscard]] const std::vector<std::string>& parameters() const { return parameters_; }
  [[nodiscard]] bool is_shard() const { return command_.shard.has_value(); }
  [[nodiscard]] bool holds(const UnitText& unit) const { return is_in_shard(shard_, unit.serial); }

  // @param place  index of the unit in the whole input. With --shard, it is written to the output,
  //               so that `axiscal merge` can restore the order of the units.
  [[nodiscard]] StreamedUnit made(const UnitText& text, std::size_t place) const {
    Unit unit{.serial = text.serial, .result = "error", .reason = text.error};
    if (text.error.empty()) {
      try {
        CsvReader csv(reader_of(text.csv), formatted("unit {}", text.serial));
        Run run = read_observations(csv, observation_columns(experiment_, Units::one));
        run.inputs = {{.path = "-", .sha256 = sha256_of_text(text.csv)}};
        std::vector<std::string> names;
        unit = calibrate_unit(command_, experiment_, run, text.serial, limits_, earlier_, names);
        unit.serial = text.serial;
        std::vector<double> cells;  // values in the order of the table's header
        for (const std::string& name : parameters_) {
          const auto at = std::find(names.begin(), names.end(), name);
          const auto from = static_cast<std::size_t>(2 * (at - names.begin()));
          if (at != names.end() && from + 1 < unit.cells.size()) {
            cells.insert(cells.end(), {unit.cells[from], unit.cells[from + 1]});
          } else {
            cells.insert(cells.end(), {std::nan(""), std::nan("")});
          }
        }
        unit.cells = std::move(cells);
      } catch (const DataError& error) {
        unit.reason = error.what();
      }
    }
    StreamedUnit streamed{.result = unit.result};
    streamed.record =
        unit.record.empty() ? refusal_json(unit, sha256_of_text(text.csv)) : unit.record;
    if (command_.store) {
      streamed.stored = stored_line(streamed.record, command_.station.value_or(text.station),
                                    command_.batch.value_or(text.batch));
    }
    streamed.record += "\n";
    streamed.row = table_row(unit, parameters_.size());
    if (is_shard()) {
      streamed.record.insert(1, formatted("\"unit\":{},", place));
      streamed.row.insert(0, formatted("{},", place));
    }
    return streamed;
  }

 private:
  const CalibrateCommand& command_;
  Experiment experiment_;
  std::optional<Limits> limits_;
  std::vector<Calibration> earlier_;
  Shard shard_;
  std::vector<std::string> parameters_;
};

// Returns true if a line of an output file belongs to a unit with a good result (see
// is_good_result()).
bool is_good_line(const std::string& line) {
  if (line.starts_with('{')) {
    return line.find("\"format\":\"axiscal-refusal\"") == std::string::npos &&
           line.find("\"status\":\"refused\"") == std::string::npos &&
           line.find("\"verdict\":{\"passed\":false") == std::string::npos;
  }
  const std::vector<std::string> cells = cells_of(line);  // columns: [unit,] serial, result
  return std::any_of(cells.begin(), cells.begin() + std::min<std::ptrdiff_t>(3, std::ssize(cells)),
                     is_good_result);
}

// Counts of the units that an earlier call has finished. Their lines in the output files are kept.
struct Finished {
  std::size_t units = 0;
  std::size_t good = 0;
  std::size_t record_bytes = 0;
  std::size_t row_bytes = 0;
  std::string last;  // line of the last record
};

// Finds the units that an earlier call has finished. They have complete lines in all outputs.
Finished finished_units(const CalibrateCommand& command) {
  // Summary of the first `most` lines after the header.
  struct Lines {
    std::size_t count = 0;
    std::size_t good = 0;
    std::size_t bytes = 0;
    std::string last;
  };
  const auto first_lines = [](const std::string& path, std::size_t header, std::size_t most) {
    Lines lines;
    std::size_t seen = 0;
    lines.bytes = read_complete_lines(path, [&](std::string_view line) {
      if (lines.count == most) {
        return false;
      }
      if (++seen > header) {
        ++lines.count;
        lines.last = line;
        lines.good += is_good_line(lines.last) ? 1U : 0U;
      }
      return true;
    });
    return lines;
  };
  const auto has = [](const std::optional<std::string>& path) {
    return path && can_be_read_again(*path);
  };
  constexpr std::size_t all = std::size_t{1} << 60U;
  Finished finished;
  if ((!command.output && !command.table) || (command.output && !has(command.output)) ||
      (command.table && !has(command.table))) {
    return finished;  // an output is missing, so all outputs are written from the start
  }
  const auto lines_of = [&](const std::optional<std::string>& path, std::size_t header,
                            std::size_t most) {
    return path ? first_lines(*path, header, most) : Lines{.count = all};
  };
  Lines records = lines_of(command.output, 0, all);
  Lines rows = lines_of(command.table, 1, all);
  finished.units = std::min(records.count, rows.count);
  // If one output has more lines than the other, the longer one is read again, up to the last unit
  // of the shorter one.
  if (command.output && records.count > finished.units) {
    records = first_lines(*command.output, 0, finished.units);
  }
  if (command.table && rows.count > finished.units) {
    rows = first_lines(*command.table, 1, finished.units);
  }
  if (finished.units == 0) {
    return finished;
  }
  finished.record_bytes = records.bytes;
  finished.row_bytes = rows.bytes;
  finished.good = command.output ? records.good : rows.good;
  finished.last = records.last;
  return finished;
}

// A set of texts, stored as hashes of 64 bits. At its maximum size of 32 MB it accepts no more
// texts.
class SerialsSeen {
 public:
  // @return false if the text was inserted before.
  bool insert(std::string_view text) {
    if (2 * count_ >= places_.size()) {
      if (places_.size() == most_places) {
        return !contains(text);
      }
      std::vector<std::uint64_t> smaller(std::max<std::size_t>(64, 2 * places_.size()));
      smaller.swap(places_);
      for (const std::uint64_t hash : smaller) {
        if (hash != 0) {
          *place_of(hash) = hash;
        }
      }
    }
    const std::uint64_t hash = hash_of(text) | 1U;  // the hash is never 0, which marks a free place
    std::uint64_t* const place = place_of(hash);
    if (*place == hash) {
      return false;
    }
    *place = hash;
    ++count_;
    return true;
  }

  [[nodiscard]] bool contains(std::string_view text) {
    return !places_.empty() && *place_of(hash_of(text) | 1U) != 0;
  }

 private:
  static constexpr std::size_t most_places = 1U << 22U;

  std::uint64_t* place_of(std::uint64_t hash) {
    std::size_t at = (hash >> 1U) & (places_.size() - 1);
    while (places_[at] != 0 && places_[at] != hash) {
      at = (at + 1) & (places_.size() - 1);
    }
    return &places_[at];
  }

  std::vector<std::uint64_t> places_;
  std::size_t count_ = 0;
};

// Returns the key of a unit with its readings: the SHA-256 of the readings, then the serial number.
std::string unit_key(const std::string& serial, const std::string& sha256) {
  return sha256 + " " + serial;
}

// Returns the keys (see unit_key()) of all units in a store.
SerialsSeen stored_units(const std::string& store) {
  SerialsSeen units;
  if (!is_store_there(store)) {
    return units;
  }
  const std::string table = ask_store(store, {"list"});
  std::size_t inputs = 0;
  bool is_header = true;
  for (std::size_t at = 0; at < table.size();) {
    const std::size_t end = std::min(table.find('\n', at), table.size());
    const std::vector<std::string> cells = cells_of(std::string_view(table).substr(at, end - at));
    if (is_header) {
      inputs =
          static_cast<std::size_t>(std::find(cells.begin(), cells.end(), "inputs") - cells.begin());
    } else if (inputs < cells.size()) {
      units.insert(unit_key(cells.front(), cells[inputs]));
    }
    is_header = false;
    at = end + 1;
  }
  return units;
}

// Checks that the last line of the earlier output belongs to `unit`. This shows that the earlier
// call had the same input.
// @throws RefusedError  if the line belongs to another unit.
void require_same_unit(const Finished& finished, const UnitText& unit) {
  if (!finished.last.empty() && finished.last.find(sha256_of_text(unit.csv)) == std::string::npos) {
    throw RefusedError(formatted(
        "--resume: line {} of the output does not belong to unit '{}' of this input, so the input "
        "or the order of its units has changed. Write to another file",
        finished.units, unit.serial));
  }
}

}  // namespace

int run_stream(const CalibrateCommand& given, const TableOptions& table_options) {
  CalibrateCommand command = given;
  command.force = true;  // refused records are written too, with status "refused"
  if (command.experiment.files.size() != 1) {
    throw UsageError("--stream: requires one FILE, or - for stdin");
  }
  if (!command.output && !command.table && !command.store) {
    throw UsageError(
        "--stream: requires -o RECORDS.jsonl (or .jsonl.zst), --table FILE or --store STORE");
  }
  if (command.output == "-" && command.table == "-") {
    throw UsageError("--stream: -o and --table cannot both be stdout");
  }
  if (command.output && command.output != "-" && !command.output->ends_with(".jsonl") &&
      !command.output->ends_with(".jsonl.zst")) {
    throw UsageError("--stream: -o must end in .jsonl or .jsonl.zst");
  }
  const Stream stream(command);
  const Finished finished = command.resume ? finished_units(command) : Finished{};
  UnitReader reader(command.experiment.files.front(),
                    observation_columns(stream.experiment(), Units::one),
                    {.options = table_options});
  std::optional<LineFile> records;
  std::optional<LineFile> table;
  std::optional<StoreWriter> database;
  std::optional<SerialsSeen> stored;  // units in the store, which are not calibrated again
  SerialsSeen seen;
  if (command.store) {
    if (command.resume && !command.output && !command.table) {
      stored = stored_units(*command.store);
    }
    database.emplace(*command.store);
  }
  if (command.output) {
    records.emplace(*command.output, finished.record_bytes);
  }
  if (command.table) {
    table.emplace(*command.table, finished.row_bytes);
    if (finished.row_bytes == 0) {
      table->write((stream.is_shard() ? "unit," : "") + table_header(stream.parameters()));
    }
  }

  std::size_t place = 0;
  std::size_t made = 0;
  std::size_t rows_before = 0;   // number of readings of the second-to-last unit
  std::size_t rows_of_last = 0;  // number of readings of the last unit
  std::size_t good = finished.good;
  std::size_t total = finished.units;
  std::size_t present = finished.units;  // number of units that an earlier call has finished
  using Pieces = std::vector<std::pair<UnitText, std::size_t>>;
  constexpr std::size_t at_once = 16;
  const auto next = [&]() -> std::optional<std::function<std::vector<StreamedUnit>()>> {
    Pieces pieces;
    while (pieces.size() < at_once) {
      std::optional<UnitText> unit = reader.next();
      if (!unit) {
        break;
      }
      const std::size_t own = place++;
      if (!unit->serial.empty() && !seen.insert(unit->serial)) {
        unit->error = formatted(
            "the serial number '{}' occurs again after another unit; the readings of a unit must "
            "follow one another. Put a second test of a unit into a separate file",
            unit->serial);
      }
      rows_before = std::exchange(
          rows_of_last,
          static_cast<std::size_t>(std::count(unit->csv.begin(), unit->csv.end(), '\n')) - 1);
      if (!stream.holds(*unit) || ++made < finished.units) {
        continue;
      }
      if (made == finished.units) {
        require_same_unit(finished, *unit);
        continue;
      }
      if (stored && stored->contains(unit_key(unit->serial, sha256_of_text(unit->csv)))) {
        ++present;
        continue;
      }
      pieces.emplace_back(std::move(*unit), own);
    }
    if (pieces.empty()) {
      return std::nullopt;
    }
    return [&stream, pieces = std::move(pieces)] {
      std::vector<StreamedUnit> units;
      for (const auto& [text, own] : pieces) {
        units.push_back(stream.made(text, own));
      }
      return units;
    };
  };
  for_each_in_order<std::vector<StreamedUnit>>(next, [&](const std::vector<StreamedUnit>& units) {
    std::string lines;
    std::string rows;
    std::string lines_for_store;
    for (const StreamedUnit& unit : units) {
      lines_for_store += unit.stored;
      lines += unit.record;
      rows += unit.row;
      good += is_good_result(unit.result) ? 1U : 0U;
      ++total;
    }
    if (records) {
      records->write(lines);
    }
    if (table) {
      table->write(rows);
    }
    if (database) {
      database->write(lines_for_store);
    }
  });
  if (database) {
    database->finish();
  }
  if (rows_of_last < rows_before) {
    print_remark("warning", formatted("the last unit has {} readings, but the unit before it has "
                                      "{}: the input may be incomplete",
                                      rows_of_last, rows_before));
  }
  if (made < finished.units) {
    throw RefusedError(
        formatted("--resume: the output has {} units, but the input has only "
                  "{}",
                  finished.units, made));
  }
  print_line(
      formatted("yield: {} of {} ({:.1f} %){}", good, total,
                total == 0 ? 0.0 : 100.0 * static_cast<double>(good) / static_cast<double>(total),
                present > 0 ? formatted("; {} were calibrated in an earlier call", present) : ""));
  return good == total ? 0 : 1;
}

}  // namespace axiscal::cli
