// SPDX-License-Identifier: Apache-2.0
#include "input.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>

#include <sha2.h>
#include <sys/types.h>
#include <system_error>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"

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
  if (calibration.status == "refused" && !force) {
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

double number_of(std::string_view option, const std::string& text) {
  const std::optional<double> number = parse_number(text);
  if (!number) {
    throw UsageError(std::string(option) + ": '" + text + "' is not a number");
  }
  return *number;
}

ReadingRange range_of(std::string_view option, const std::string& text) {
  const std::vector<double> ends = numbers_of(option, text, 2);
  if (!(ends[0] < ends[1])) {
    throw UsageError(std::string(option) + ": LO must be less than HI");
  }
  return {.low = ends[0], .high = ends[1]};
}

double positive_of(std::string_view option, const std::string& text) {
  const double value = number_of(option, text);
  if (!(value > 0.0)) {
    throw UsageError(std::string(option) + ": must be positive");
  }
  return value;
}

double not_negative_of(std::string_view option, const std::string& text) {
  const double value = number_of(option, text);
  if (value < 0.0) {
    throw UsageError(std::string(option) + ": must not be negative");
  }
  return value;
}

Site site_of_options(const std::optional<std::string>& latitude,
                     const std::optional<std::string>& longitude,
                     const std::optional<std::string>& height,
                     Site otherwise) {
  Site site = otherwise;
  if (latitude) {
    site.latitude_deg = number_of("--latitude", *latitude);
  }
  if (longitude) {
    site.longitude_deg = number_of("--longitude", *longitude);
  }
  if (height) {
    site.height_m = number_of("--height", *height);
  }
  try {
    check_site(site);
  } catch (const DomainError& error) {
    throw UsageError(error.what());
  }
  return site;
}

double date_of_option(const std::string& text) {
  const std::optional<double> time_s = parse_date(text);
  if (!time_s) {
    throw UsageError("--date: '" + text + "' is neither ISO 8601 nor a decimal year");
  }
  return *time_s;
}

Eigen::Vector2d slope_of_option(const std::string& text) {
  const std::vector<double> numbers = numbers_of("--slope", text, 2);
  const Eigen::Vector2d slope(numbers[0], numbers[1]);
  if (!(slope.norm() < 1.0)) {
    throw UsageError("--slope: X^2 + Y^2 must be less than 1");
  }
  return slope;
}

Method method_of_option(const std::string& text) {
  const std::optional<Method> method = parse_method(text);
  if (!method) {
    throw UsageError(
        "--method: '" + text +
        "' is not known to this version; it knows paired, joint, known, magnitude, bias");
  }
  return *method;
}

LevelBy level_by_of_option(const std::string& text) {
  const std::optional<LevelBy> level_by = parse_level_by(text);
  if (!level_by) {
    throw UsageError("--level-by: must be run or block, not '" + text + "'");
  }
  return *level_by;
}

std::vector<double> numbers_of(std::string_view option,
                               const std::string& text,
                               std::size_t count) {
  const std::optional<std::vector<double>> numbers = parse_numbers(text);
  if (!numbers || numbers->size() != count) {
    throw UsageError(std::string(option) + ": '" + text + "' are not " + std::to_string(count) +
                     " numbers parted by commas");
  }
  return *numbers;
}

std::uint64_t seed_of(const SheetOptions& options) {
  if (!options.seed) {
    return 1;
  }
  std::uint64_t seed = 0;
  const char* end = options.seed->data() + options.seed->size();
  const auto [stop, error] = std::from_chars(options.seed->data(), end, seed);
  if (error != std::errc{} || stop != end) {
    throw UsageError("--seed: '" + *options.seed + "' is not a whole number from 0 to 2^64 - 1");
  }
  return seed;
}

int replicates_of(const SheetOptions& options) {
  constexpr int most_replicates = 100000;
  if (!options.replicates) {
    return 1;
  }
  const int replicates = parse_integer(*options.replicates).value_or(0);
  if (replicates < 1 || replicates > most_replicates) {
    throw UsageError("--replicates: '" + *options.replicates +
                     "' is not a whole number from 1 to 100000");
  }
  return replicates;
}

std::optional<OptimalDesign> optimal_design_of(const SheetOptions& options) {
  constexpr std::string_view optimal = "optimal:";
  if (!options.design.starts_with(optimal)) {
    return std::nullopt;
  }
  const std::optional<int> points = parse_integer(options.design.substr(optimal.size()));
  if (!points || *points < 4 || *points > 24) {
    throw UsageError("--design: '" + options.design + "' must be optimal:N, N from 4 to 24");
  }
  return optimal_design(*points, Eigen::Vector3d::UnitZ(), seed_of(options));
}

std::vector<DesignEntry> design_of(const SheetOptions& options) {
  if (options.design == "6" || options.design == "12" || options.design == "24") {
    return standard_design(*parse_integer(options.design));
  }
  if (const std::optional<OptimalDesign> optimal = optimal_design_of(options)) {
    return optimal->design;
  }
  if (parse_number(options.design)) {
    throw UsageError("--design: the designs have 6, 12 or 24 points, not " + options.design);
  }
  InputFile file(options.design);
  CsvReader csv = csv_reader_of(file);
  return read_design(csv);
}

std::vector<double> temperatures_of(const SheetOptions& options) {
  std::vector<double> temperatures;
  if (options.temperatures) {
    for (const std::string_view text : split(*options.temperatures, ',')) {
      temperatures.push_back(number_of("--temperatures", std::string(text)));
    }
  }
  return temperatures;
}

std::vector<RunSheetRow> make_sheet(const SheetOptions& options) {
  const int replicates = replicates_of(options);
  const std::uint64_t seed = seed_of(options);
  return make_run_sheet(design_of(options), replicates, seed, temperatures_of(options));
}

Tolerances tolerances_of(const std::string& text) {
  Tolerances tolerances;
  for (const std::string_view item : split(text, ',')) {
    const std::size_t parting = item.find('=');
    const std::string name(item.substr(0, parting));
    double* value = name == "foot_height_m"    ? &tolerances.foot_height_m
                    : name == "ball_radius_m"  ? &tolerances.ball_radius_m
                    : name == "squareness_rad" ? &tolerances.squareness_rad
                    : name == "fence_rad"      ? &tolerances.fence_rad
                                               : nullptr;
    if (value == nullptr || parting == std::string_view::npos) {
      throw UsageError("--tolerances: '" + std::string(item) +
                       "' must be one of foot_height_m, ball_radius_m, squareness_rad, fence_rad, "
                       "=, and its standard deviation");
    }
    *value = not_negative_of("--tolerances", std::string(item.substr(parting + 1)));
  }
  return tolerances;
}

CubeFeet drawing_of(const Positioner& positioner) {
  CubeFeet drawing = feet_of_frame({});
  for (const Face face : all_faces) {
    if (positioner.feet(face)) {
      drawing[static_cast<std::size_t>(face)] = *positioner.feet(face);
    }
  }
  return drawing;
}

int whole_number_of(std::string_view option, const std::string& text, int least) {
  const std::optional<int> value = parse_integer(text);
  if (!value || *value < least) {
    throw UsageError(std::string(option) + ": '" + text + "' is not a whole number from " +
                     std::to_string(least) + " on");
  }
  return *value;
}

void set_adjusters(const std::optional<std::string>& adjusters,
                   const std::optional<std::string>& thread_pitch,
                   Surface& surface) {
  if (adjusters) {
    surface.adjusters_m.clear();
    for (const std::string_view pair : split(*adjusters, ';')) {
      if (std::count(pair.begin(), pair.end(), ',') != 1) {
        throw UsageError("--adjusters: '" + *adjusters +
                         "' must be positions in metres, \"X,Y;X,Y;X,Y\"");
      }
      const std::vector<double> xy = numbers_of("--adjusters", std::string(pair), 2);
      surface.adjusters_m.emplace_back(xy[0], xy[1]);
    }
  }
  if (thread_pitch) {
    surface.thread_pitch_m = number_of("--thread-pitch", *thread_pitch);
  }
  if (surface.adjusters_m.empty()) {
    throw UsageError(
        "where the table's height adjusters stand is missing: --adjusters \"X,Y;X,Y;X,Y\" in "
        "metres, or a positioner with a table");
  }
  try {
    const Eigen::Vector2d none = Eigen::Vector2d::Zero();
    static_cast<void>(level_table(none, Eigen::Matrix2d::Zero(), surface));
  } catch (const DomainError& error) {
    throw UsageError(std::string("--adjusters: ") + error.what());
  }
}

PitchFormula pitch_formula_of(std::string_view option, const std::string& text) {
  if (text != "asin" && text != "atan2") {
    throw UsageError(std::string(option) + ": must be asin or atan2, not '" + text + "'");
  }
  return text == "atan2" ? PitchFormula::arctangent : PitchFormula::arcsine;
}

}  // namespace axiscal::cli
