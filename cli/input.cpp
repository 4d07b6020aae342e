// SPDX-License-Identifier: Apache-2.0
#include "input.hpp"

#include <algorithm>
#include <array>
#include <filesystem>

#include <sha2.h>
#include <sys/types.h>
#include <system_error>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"

namespace axiscal::cli {

namespace {

CsvReader csv_reader_of_text(const std::string& text, const std::string& path) {
  return {[rest = std::string_view(text)](char* buffer, std::size_t size) mutable {
            const std::size_t count = rest.copy(buffer, size);
            rest.remove_prefix(count);
            return count;
          },
          path};
}

std::string sha256_of_text(const std::string& text) {
  std::array<char, SHA256_DIGEST_STRING_LENGTH> digest{};
  return SHA256Data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), digest.data());
}

// Two instruments in one file, which may be a pipe: it is read once and held.
ObservationsFile read_two_instruments(const std::string& path,
                                      const ObservationColumns& columns,
                                      const ObservationColumns& beside) {
  const std::string text = read_whole_file(path);
  CsvReader csv = csv_reader_of_text(text, path);
  CsvReader csv_beside = csv_reader_of_text(text, path);
  ObservationsFile result{.table = read_observations(csv, columns),
                          .beside = read_observations(csv_beside, beside).observations,
                          .sha256 = sha256_of_text(text)};
  std::erase_if(result.table.ignored_columns, [&](const std::string& name) {
    return std::any_of(beside.differences.begin(), beside.differences.end(),
                       [&](const DifferentialAxis& axis) {
                         return axis.plus == name || axis.minus == name;
                       }) ||
           std::find(beside.axes.begin(), beside.axes.end(), name) != beside.axes.end();
  });
  return result;
}

}  // namespace

ObservationsFile read_observations_file(const std::string& path,
                                        const ObservationColumns& columns,
                                        const std::optional<ObservationColumns>& beside) {
  if (beside) {
    return read_two_instruments(path, columns, *beside);
  }
  InputFile file(path);
  SHA2_CTX digest;
  SHA256Init(&digest);
  CsvReader csv(
      [&](char* buffer, std::size_t size) {
        const std::size_t count = file.read(buffer, size);
        SHA256Update(&digest, reinterpret_cast<const std::uint8_t*>(buffer), count);
        return count;
      },
      path);
  ObservationsFile result{.table = read_observations(csv, columns)};
  std::array<char, SHA256_DIGEST_STRING_LENGTH> text{};
  result.sha256 = SHA256End(&digest, text.data());
  return result;
}

Calibration read_unrefused(const std::string& record, bool force) {
  Calibration calibration = read_calibration(record);
  if (calibration.status == CalibrationStatus::refused && !force) {
    throw RefusedError(record +
                       ": this calibration was refused; look at its warnings, or use --force");
  }
  return calibration;
}

std::string sha256_of_file(const std::string& path) {
  std::array<char, SHA256_DIGEST_STRING_LENGTH> text{};
  std::error_code none;  // a pipe would be waited for: it was read once
  if (path == "-" || !std::filesystem::is_regular_file(path, none) ||
      SHA256File(path.c_str(), text.data()) == nullptr) {
    return "";
  }
  return text.data();
}

CsvReader csv_reader_of(InputFile& file, CsvReader::Quotes quotes) {
  return {[&file](char* buffer, std::size_t size) { return file.read(buffer, size); }, file.path(),
          quotes};
}

}  // namespace axiscal::cli
