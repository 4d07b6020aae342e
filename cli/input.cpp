// SPDX-License-Identifier: Apache-2.0
#include "input.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <future>

#include <sha2.h>
#include <sys/types.h>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/parallel.hpp"
#include "core/formatted.hpp"

namespace axiscal::cli {

std::string sha256_of_text(const std::string& text) {
  std::array<char, SHA256_DIGEST_STRING_LENGTH> digest{};
  return SHA256Data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), digest.data());
}

std::function<std::size_t(char* buffer, std::size_t size)> reader_of(const std::string& text) {
  return [rest = std::string_view(text)](char* buffer, std::size_t size) mutable {
    const std::size_t count = rest.copy(buffer, size);
    rest.remove_prefix(count);
    return count;
  };
}

namespace {

// Returns the columns of the readings: the axes of the instrument. If there are slots, these are
// the axes of all slots.
std::vector<std::string> axes_of(const ObservationColumns& columns) {
  if (columns.slots.empty()) {
    return columns.axes;
  }
  std::vector<std::string> axes;
  for (const SlotColumns& slot : columns.slots) {
    for (const std::string& axis : slot.axes) {
      axes.push_back(formatted("{}.{}", slot.slot, axis));
    }
  }
  return axes;
}

WantedColumns wanted_of(const ObservationColumns& columns, const TableReading& reading) {
  return {.axes = axes_of(columns),
          .kind = reading.kind,
          .unit = reading.unit,
          .of_recording = reading.of_recording,
          .faces_of = columns.face_names.empty() ? reading.faces_of : ""};
}

// Reads the readings of two instruments from one file. It reads the file into memory only once,
// because the file may be a pipe.
ObservationsFile read_two_instruments(const std::string& path,
                                      const ObservationColumns& columns,
                                      const ObservationColumns& beside,
                                      const TableReading& reading) {
  const std::string text = read_whole_file(path);
  const OpenTable own = open_table(path, reading.options, wanted_of(columns, reading),
                                   CsvReader::Quotes::span_lines, reader_of(text));
  const OpenTable others = open_table(path, reading.options, {.axes = beside.axes},
                                      CsvReader::Quotes::span_lines, reader_of(text));
  ObservationsFile result{.run = read_observations(*own.csv, columns),
                          .beside = read_observations(*others.csv, beside).observations};
  result.run.inputs = {{.path = path, .sha256 = sha256_of_text(text)}};
  std::erase_if(result.run.ignored_columns, [&](const std::string& name) {
    return std::any_of(beside.differences.begin(), beside.differences.end(),
                       [&](const DifferentialAxis& axis) {
                         return axis.plus == name || axis.minus == name;
                       }) ||
           std::find(beside.axes.begin(), beside.axes.end(), name) != beside.axes.end();
  });
  return result;
}

}  // namespace

OpenTable open_observations(
    const std::string& path,
    const ObservationColumns& columns,
    const TableReading& reading,
    const std::function<std::size_t(char* buffer, std::size_t size)>& read) {
  return open_table(path, reading.options, wanted_of(columns, reading),
                    CsvReader::Quotes::span_lines, read);
}

ObservationsFile read_observations_file(const std::string& path,
                                        const ObservationColumns& columns,
                                        const std::optional<ObservationColumns>& beside,
                                        const TableReading& reading) {
  if (beside) {
    return read_two_instruments(path, columns, *beside, reading);
  }
  if (can_be_read_again(path)) {
    const OpenTable table = open_table(path, reading.options, wanted_of(columns, reading));
    // Computing the digest of a large file takes longer than reading the table, so another thread
    // does it.
    constexpr std::uintmax_t worth_a_thread = 1U << 20U;
    std::error_code none;
    const bool is_large = std::filesystem::file_size(path, none) > worth_a_thread && !none;
    std::future<std::string> digest = begin_work([&] { return sha256_of_file(path); }, is_large);
    ObservationsFile result{.run = read_observations(*table.csv, columns), .beside = {}};
    result.run.inputs = {{.path = path, .sha256 = digest.get()}};
    return result;
  }
  // A pipe can be read only once, so its digest is computed while it is read.
  InputFile file(path);
  SHA2_CTX digest;
  SHA256Init(&digest);
  const OpenTable table =
      open_observations(path, columns, reading, [&](char* buffer, std::size_t size) {
        const std::size_t count = file.read(buffer, size);
        SHA256Update(&digest, reinterpret_cast<const std::uint8_t*>(buffer), count);
        return count;
      });
  ObservationsFile result{.run = read_observations(*table.csv, columns), .beside = {}};
  std::array<char, SHA256_DIGEST_STRING_LENGTH> text{};
  result.run.inputs = {{.path = path, .sha256 = SHA256End(&digest, text.data())}};
  return result;
}

Calibration read_unrefused(const std::string& record, bool force) {
  Calibration calibration = read_calibration(record);
  if (calibration.findings.status == CalibrationStatus::refused && !force) {
    throw RefusedError(record +
                       ": this calibration was refused; look at its warnings, or use --force");
  }
  return calibration;
}

std::string sha256_of_file(const std::string& path) {
  std::array<char, SHA256_DIGEST_STRING_LENGTH> text{};
  // A pipe cannot be read a second time.
  if (!can_be_read_again(path) || SHA256File(path.c_str(), text.data()) == nullptr) {
    return "";
  }
  return text.data();
}

}  // namespace axiscal::cli
